#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Stories that verify_bag is told. Each is told twice: to the chain as it was, and under a new chain
that is sound (forge_bag), which leaves it to the repetition to find what is wrong."""
import os
import random
import shutil
import subprocess
import tempfile
import time
import unittest

import rospy
import rostest
from client import Client, executable
from contact_flow.msg import InitialState, SimulationOptions
from forging import (
    DIFFERS, INCOMPLETE, VERIFIED, Entry, change_one, forge_bag, next_up, read, verify, verify_after,
    write)
from simulator_client import RecordingNode, Simulator

class ForgedBags(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = tempfile.mkdtemp()
        cls.online = cls.record_online()
        cls.results = cls.record_results()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.directory)

    @classmethod
    def record_online(cls):
        node = RecordingNode(cls.directory, "told", model="falling_box", paused="true", rate="50",
                             **{"options/complete_zeno": "true"})
        box = Simulator("told")
        size = len(box.get_state().state.inputs)
        answers = []
        for k in range(3):
            answers += [box.step(seconds=0.1), box.set_input(values=[0.1 * k] * size),
                        box.apply_impulse(names=["x"], impulse=[0.1]), box.step(seconds=0.1),
                        box.set_input(values=[0.2] * size, at=box.get_state().state.t + 0.15),
                        box.set_parameters(names=["mass"], values=[1 + 0.1 * k]),
                        box.mark(directions=["+z"]), box.step(seconds=0.05),
                        box.predict(horizon=0.1, directions=["+z"]),
                        box.set_state(state=InitialState(names=["y"], positions=[0.5 + k])),
                        box.step(seconds=0.2)]
            time.sleep(0.5)
        box.reset_simulation()
        answers.append(box.step(events=1, seconds=0.2))
        time.sleep(0.5)
        for answer in answers:
            assert answer.success, answer.message
        node.stop()
        return node.bag

    @classmethod
    def record_results(cls):
        process = subprocess.Popen([executable("contact_flow_node"), "__name:=answering",
                                    "_bag_directory:=" + cls.directory], stdout=subprocess.DEVNULL)
        client = Client("/answering")
        path = client.start_recording(name="results").path
        for pitch in (0.0, 0.01):
            state = InitialState(names=["body_pitch"], positions=[pitch])
            assert client.simulate(state=state, samples=20).success
            assert client.b_derivative(state=state).success
        assert client.stop_recording().success
        process.terminate()
        process.wait(timeout=30)
        return path

    def told(self, entries):
        """Exit codes for the chain as it was, and for a new one."""
        changed = os.path.join(self.directory, "changed.bag")
        forged = os.path.join(self.directory, "forged.bag")
        write(changed, entries)
        forge_bag(changed, forged)
        return verify(changed), verify(forged)

    def expect(self, entries, name, by_chain=DIFFERS, forged=DIFFERS):
        one, two = self.told(entries)
        self.assertEqual(one[0], by_chain, name + "\n" + one[1][-1500:])
        self.assertEqual(two[0], forged, name + " under a new chain\n" + two[1][-1500:])

    def of(self, entries, topic):
        return [e for e in entries if e.topic == topic]

    def test_honest_bags_are_verified(self):
        for path in (self.online, self.results):
            code, output = verify(path)
            self.assertEqual(code, VERIFIED, output[-1500:])
            self.expect(read(path), "rewritten", VERIFIED, VERIFIED)

    def test_what_follows_from_the_state_is_computed_again(self):
        draw = random.Random(1)

        def joints(m):
            m.position = change_one(m.position, draw)

        def transforms(m):
            t = m.transforms[0].transform.translation
            t.x = next_up(t.x)

        def wrench(m):
            m.wrench.force.z = next_up(m.wrench.force.z)

        def markers(m):
            m.markers[0].pose.position.x = next_up(m.markers[0].pose.position.x)

        def force(m):
            m.force = change_one(m.force, draw)

        def events(m):
            m.events += 1

        def later(m):
            m.t = next_up(m.t)

        def epoch(m):
            m.epoch -= 1

        def factor(m):
            m.real_time_factor = 2

        def value(m):
            m.status[0].values[0].value = "0.125"

        def frame(m):
            m.header.frame_id = "elsewhere"

        def sequence(m):
            m.header.seq = 7

        def stamp(m):
            m.header.stamp += rospy.Duration(0, 1000)

        def add_warning(m):
            m.warnings = []
            m.q = change_one(m.q, draw)

        entries = read(self.online)
        topics = {e.topic for e in entries}
        wrench_topic = sorted(t for t in topics if "/wrench/" in t)[0]
        for topic, change in (("/joint_states", joints), ("/joint_states", stamp), ("/tf", transforms),
                              (wrench_topic, wrench), ("/told/contacts", markers),
                              ("/told/status", force), ("/told/status", events),
                              ("/told/status", epoch), ("/told/status", factor),
                              ("/told/status", stamp), ("/diagnostics", value),
                              ("/told/state", frame), ("/told/state", sequence),
                              ("/told/state", later), ("/told/state", stamp),
                              ("/told/prediction", epoch), ("/told/prediction", add_warning),
                              ("/told/events", frame), ("/told/epoch", sequence)):
            entries = read(self.online)
            messages = [e.message for e in self.of(entries, topic)]
            change(draw.choice([m for m in messages if getattr(m, "force", True)]))
            self.expect(entries, topic + " " + change.__name__)

    def test_predictions_before_the_recording_are_none(self):
        entries = read(self.online)
        prediction = self.of(entries, "/told/prediction")[1].message
        prediction.epoch = 0
        prediction.q = [3.0] * len(prediction.q)
        self.expect(entries, "epoch 0")

    def test_a_teleport_is_no_impulse(self):
        for before_too in (False, True):
            entries = read(self.online)
            epoch = next(e.message for e in self.of(entries, "/told/epoch")
                         if e.message.cause == "set_state")
            epoch.cause = "apply_impulse"
            epoch.impulse = [1e-9] + [0.0] * (len(epoch.v) - 1)
            if before_too:
                epoch.q_before, epoch.v_before = [], []
            self.expect(entries, "relabelled")

    def test_epochs_follow_each_other(self):
        entries = read(self.online)
        causes = [e.message.cause for e in self.of(entries, "/told/epoch")]
        cut = causes.index("set_parameters") + 1
        inside = [i for i, e in enumerate(entries) if e.topic == "/told/epoch"]
        # One is cut out, with everything in it …
        without = entries[:inside[cut - 1]] + entries[inside[cut]:]
        self.expect(without, "cut out", INCOMPLETE)
        # … and the numbers of the others are moved up.
        entries = read(self.online)
        without = entries[:inside[cut - 1]] + entries[inside[cut]:]
        for e in without[inside[cut - 1]:]:
            if hasattr(e.message, "epoch"):
                e.message.epoch -= 1
        one, two = self.told(without)
        self.assertIn(one[0], (DIFFERS, INCOMPLETE))
        self.assertEqual(two[0], DIFFERS, two[1][-1500:])

        def cause(m):
            m.cause = "start_recording"

        def time_before(m):
            m.t_before = next_up(m.t_before)

        def velocity_before(m):
            m.v_before = [next_up(v) for v in m.v_before]

        def parameter(m):
            m.parameter_values = change_one(m.parameter_values, random.Random(3))

        def another_input(m):
            m.input = [1.0] * len(m.input)

        for change, which in ((cause, "reset_simulation"), (time_before, "apply_impulse"),
                              (velocity_before, "set_state"), (parameter, "apply_impulse"),
                              (parameter, "reset_simulation"), (another_input, "apply_impulse")):
            entries = read(self.online)
            change([e.message for e in self.of(entries, "/told/epoch") if e.message.cause == which][-1])
            self.expect(entries, change.__name__)

    def test_inputs_that_still_hold_are_told_again(self):
        entries = read(self.online)
        again = [e for e in self.of(entries, "/told/input_taken")
                 if any(f.topic == "/told/epoch" and f.message.epoch == e.message.epoch and
                        f.message.cause == "set_parameters" for f in entries)]
        entries.remove(again[0])
        self.expect(entries, "input dropped", INCOMPLETE)

    def test_topics_that_are_renamed(self):
        for topic, name in (("/told/state", "/told/status"), ("/joint_states", "/other_joints"),
                            ("/told/contacts", "/told/terrain"), ("/told/events", "/told/announced")):
            entries = read(self.online)
            header = None
            for e in self.of(entries, topic):
                header = header or dict(e.header, topic=name)
                e.topic, e.header = name, header
            self.assertNotEqual(verify_after(self.told, entries), VERIFIED, topic)

    def test_a_tail_that_is_cut_off_is_missed(self):
        entries = read(self.online)
        for keep in (len(entries) - 1, len(entries) // 2):
            one, two = self.told(entries[:keep])
            self.assertEqual((one[0], two[0]), (INCOMPLETE, INCOMPLETE), one[1][-500:] + two[1][-500:])
        # The end itself put at an earlier place: a new chain can say so, the old one cannot.
        half = entries[:len(entries) // 2]
        self.assertNotEqual(self.told(half + entries[-1:])[0][0], VERIFIED)

    def test_results_follow_their_records(self):
        entries = read(self.results)
        first, second = self.of(entries, "/answering/trajectory")
        first.message = second.message
        self.expect(entries, "the newer for the older")
        entries = read(self.results)
        first, second = self.of(entries, "/answering/trajectory")
        second.message = first.message
        self.expect(entries, "the older for the newer")
        entries = read(self.results)
        entries.remove(self.of(entries, "/answering/trajectory")[1])
        self.expect(entries, "without a copy", INCOMPLETE)
        entries = read(self.results)
        record = self.of(entries, "/answering/record/simulation")[0].message
        record.result.steps += 1
        self.expect(entries, "one step more")

    def test_a_result_that_was_ended_by_time_is_verified_up_to_there(self):
        process = subprocess.Popen([executable("contact_flow_node"), "__name:=hurried",
                                    "_model:=hopping_trot", "_bag_directory:=" + self.directory],
                                   stdout=subprocess.DEVNULL)
        client = Client("/hurried")
        path = client.start_recording(name="hurried").path
        # Long enough for any machine; short, since one of the stories has it run to its end.
        answer = client.simulate(duration=1e4, samples=1, options=SimulationOptions(
            max_seconds=0.3, max_steps=10**9, max_events=10**6))
        self.assertTrue(answer.success, answer.message)
        self.assertIn("max_seconds", answer.message)
        client.stop_recording()
        process.terminate()
        process.wait(timeout=30)
        code, output = verify(path)
        self.assertEqual(code, VERIFIED, output[-1500:])
        for change in ("t_end", "message", "outcome"):
            entries = read(path)
            for e in entries:
                result = getattr(e.message, "result", e.message)
                if e.topic.endswith(("/trajectory", "record/simulation")):
                    if change == "t_end":
                        result.t_end = next_up(result.t_end)
                    elif change == "message":
                        result.message = result.message.replace("stopped at t = ", "stopped at t = 1")
                    else:
                        result.outcome = 0
            self.assertNotEqual(self.told(entries)[1][0], VERIFIED, change)

    def test_signed_bags_are_those_of_the_key(self):
        key = os.path.join(self.directory, "key.pem")
        public = os.path.join(self.directory, "key.pub")
        subprocess.run(["openssl", "genpkey", "-algorithm", "ed25519", "-out", key], check=True)
        subprocess.run(["openssl", "pkey", "-in", key, "-pubout", "-out", public], check=True)
        process = subprocess.Popen([executable("contact_flow_node"), "__name:=signing",
                                    "_signing_key:=" + key, "_bag_directory:=" + self.directory],
                                   stdout=subprocess.DEVNULL)
        client = Client("/signing")
        path = client.start_recording(name="signed").path
        self.assertTrue(client.simulate(samples=20).success)
        client.stop_recording()
        process.terminate()
        process.wait(timeout=30)
        forged = os.path.join(self.directory, "not_signed.bag")
        forge_bag(path, forged)
        self.assertEqual(verify(path)[0], VERIFIED)
        self.assertEqual(verify("--key", public, path)[0], VERIFIED)
        self.assertEqual(verify(forged)[0], VERIFIED)  # the same story, told by somebody else
        self.assertEqual(verify("--key", public, forged)[0], INCOMPLETE)
        self.assertEqual(verify("--key", public, self.results)[0], INCOMPLETE)

    def test_many_forged_ones(self):
        """Random ones of all kinds, by the parameter `bags`: none is verified."""
        draw = random.Random(20)
        for k in range(rospy.get_param("bags", 0)):
            entries = read(draw.choice((self.online, self.results)))
            inner = [i for i, e in enumerate(entries) if "/recording/" not in e.topic]
            i, j = sorted(draw.sample(inner, 2))
            kind = draw.randrange(4)
            if kind == 0:
                del entries[i:j]
            elif kind == 1:
                entries[i].message, entries[j].message = entries[j].message, entries[i].message
                if entries[i].topic != entries[j].topic:
                    entries[i].topic, entries[j].topic = entries[j].topic, entries[i].topic
                    entries[i].header, entries[j].header = entries[j].header, entries[i].header
            elif kind == 2:
                entries[i].message = draw.choice(
                    [e for e in self.of(entries, entries[i].topic)]).message
                del entries[j]
            else:
                entries.insert(j, Entry(entries[i].topic, entries[i].message,
                                        entries[j].stamp, entries[i].header))
            changed = os.path.join(self.directory, "changed.bag")
            write(changed, entries)
            code, output = verify(changed)
            self.assertIn(code, (DIFFERS, INCOMPLETE), "forged bag %d\n%s" % (k, output[-800:]))


if __name__ == "__main__":
    rospy.init_node("forged_bags_test")
    rostest.rosrun("contact_flow", "forged_bags", ForgedBags)
