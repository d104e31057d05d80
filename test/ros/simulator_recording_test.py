#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of the simulator: repeated to the bit, played, and killed."""
import os
import random
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import numpy
import rosbag
import rospy
import rostest
from client import executable, wait_until
from contact_flow.msg import InitialState, SimulatorEvent
from simulator_client import RecordingNode, Simulator, verified, verify
from sensor_msgs.msg import JointState

INCOMPLETE = 3


def copy_bag(source, target, change):
    """Copies those messages for which change(topic, message) is not False, as it leaves them."""
    with rosbag.Bag(source) as bag, rosbag.Bag(target, "w") as copy:
        for topic, message, stamp, header in bag.read_messages(return_connection_header=True):
            if change(topic, message) is not False:
                copy.write(topic, message, stamp, connection_header=header)


def with_another_last_bit(values):
    """The largest number is the next one."""
    values = list(values)
    k = max(range(len(values)), key=lambda i: abs(values[i]))
    values[k] = float(numpy.nextafter(values[k], numpy.inf))
    return values


class SimulatorRecording(unittest.TestCase):
    def test_everything_is_repeated_to_the_bit(self):
        with tempfile.TemporaryDirectory() as directory:
            node = RecordingNode(directory, "busy", model="falling_box", paused="true",
                                 **{"options/complete_zeno": "true"})
            box = Simulator("busy")
            for k in range(3):
                box.step(seconds=0.11)
                box.set_input(values=[0.3 * k, 0.1, 0.2, 0, 0.01 * k, 0][:len(
                    box.get_state().state.inputs)])
                box.set_input(values=[0.1 * k] * len(box.get_state().state.inputs),
                              at=box.get_state().state.t + 0.05)
                box.step(seconds=0.03)
                self.assertTrue(box.apply_impulse(names=["x"], impulse=[0.1]).success)
                box.step(seconds=0.04)
                self.assertTrue(box.set_state(state=InitialState(names=["y"], positions=[k])).success)
                box.step(events=1, seconds=0.1)
                self.assertTrue(box.set_parameters(names=["mass"], values=[1 + 0.1 * k]).success)
                box.unpause_physics()
                time.sleep(0.2)
                box.pause_physics()
                (box.reset_world if k == 1 else box.reset_simulation)()
            node.stop()
            result = verify(node.bag)
            self.assertEqual(result.returncode, 0, result.stdout[-2000:])
            self.assertIn(" 0 differ", result.stdout)
            with rosbag.Bag(node.bag) as bag:
                causes = [m.cause for _, m, _ in bag.read_messages(topics=["/busy/epoch"])]
                self.assertEqual(causes.count("apply_impulse"), 3)
                self.assertEqual(causes[0], "start")
                # A bit of a state, and verify_bag finds it.
                forged = os.path.join(directory, "forged.bag")
                with rosbag.Bag(forged, "w") as copy:
                    count = 0
                    for topic, message, stamp in bag.read_messages():
                        if topic == "/busy/state":
                            count += 1
                            if count == 20:
                                message.v = list(message.v)
                                message.v[2] += 1e-15 * (1 + abs(message.v[2]))
                        copy.write(topic, message, stamp)
            self.assertEqual(verify(forged).returncode, 1)

    def record_marks_and_predictions(self, directory, name):
        """The bag of a run that is marked, looked at slowly and at once, pushed and predicted."""
        node = RecordingNode(directory, name, model="falling_box", paused="true", rate="150",
                             **{"options/complete_zeno": "true", "derivative_options/tolerance": "1e-8"})
        box = Simulator(name)
        size = len(box.get_state().state.inputs)
        answers = [box.mark(directions=["+z", "-z", "+d/dt pitch"]), box.step(seconds=0.013)]
        answers += [box.set_input(values=[0.1] * size), box.step(seconds=0.2)]
        box.unpause_physics()
        answers.append(box.predict(horizon=0.3, directions=["+z", "-z"], size=0.01))
        time.sleep(0.2)
        answers += [box.set_parameters(names=["mass"], values=[1.2]),
                    box.mark(by_inputs=True, by_parameters=["mass"], project_directions=True)]
        time.sleep(0.2)
        box.pause_physics()
        answers += [box.set_input(values=[-0.1] * size, at=box.get_state().state.t + 0.1),
                    box.predict(horizon=0.2), box.step(seconds=0.05), box.mark(clear=True),
                    box.step(seconds=0.05), box.mark(directions=["+x"]), box.step(seconds=0.03)]
        for answer in answers:
            self.assertTrue(answer.success, answer.message)
        self.assertFalse(box.predict(horizon=-1).success)
        self.assertFalse(box.predict(horizon=0.1, directions=["+w"]).success)
        node.stop()
        return node.bag

    def test_marks_and_predictions_are_repeated_to_the_bit(self):
        with tempfile.TemporaryDirectory() as directory:
            path = self.record_marks_and_predictions(directory, "marked")
            whole = verify(path)
            self.assertEqual(whole.returncode, 0, whole.stdout[-2000:])
            counts = {}

            def count(topic, _):
                counts[topic] = counts.get(topic, 0) + 1
            forged = os.path.join(directory, "forged.bag")
            copy_bag(path, forged, count)
            self.assertEqual(counts["/marked/mark_taken"], 4)
            self.assertEqual(counts["/marked/prediction_asked"], 2)
            self.assertEqual(counts["/marked/prediction"], 2)
            self.assertGreater(counts["/marked/rolling_derivative"], 20)
            # Each counts …
            for topic in ("/marked/rolling_derivative", "/marked/prediction"):
                copy_bag(path, forged, lambda at, _, topic=topic: at != topic)
                rest = verify(forged)
                self.assertEqual(rest.returncode, INCOMPLETE, rest.stdout[-2000:])
                self.assertEqual(verified(whole) - verified(rest), counts[topic])

            # … and the last bit of each.
            def forge_tangents(message):
                message.tangents.data = with_another_last_bit(message.tangents.data)

            def forge_time_derivative(message):
                message.time_derivative = with_another_last_bit(message.time_derivative)

            def forge_fan(message):
                message.fan.data = with_another_last_bit(message.fan.data)

            for topic, forge, which in (("/marked/rolling_derivative", forge_tangents, 17),
                                        ("/marked/rolling_derivative", forge_time_derivative, 3),
                                        ("/marked/prediction", forge_fan, 2)):
                seen = []

                def change(at, message, topic=topic, forge=forge, which=which, seen=seen):
                    if at == topic:
                        seen.append(at)
                        if len(seen) == which:
                            forge(message)
                copy_bag(path, forged, change)
                result = verify(forged)
                self.assertEqual(result.returncode, 1)
                self.assertIn(" 2 differ", result.stdout)  # the message, and its link
                self.assertEqual(verified(whole) - verified(result), 1)
            # Without the marks there is nothing to compare with.
            copy_bag(path, forged, lambda at, _: at != "/marked/mark_taken")
            self.assertEqual(verify(forged).returncode, INCOMPLETE)

    def test_a_long_recording_is_verified_across_its_parts(self):
        with tempfile.TemporaryDirectory() as directory:
            node = RecordingNode(directory, "long", model="hopping_trot", bag_split_size=0.1, mark="true",
                                 busy_wait="true")
            trot = Simulator("long")
            part = node.bag.replace(".bag", "_%d.bag")
            self.assertTrue(wait_until(lambda: os.path.exists(part % 2)))
            self.assertTrue(trot.apply_impulse(names=[trot.get_state().state.velocities[0]],
                                               impulse=[0.01]).success)
            self.assertTrue(trot.mark().success)
            last = max(k for k in range(1, 1000) if os.path.exists(part % k))
            self.assertTrue(wait_until(lambda: os.path.exists(part % (last + 2))))
            answer = trot.stop_recording()
            self.assertTrue(answer.success, answer.message)
            node.stop()
            parts = answer.paths[1:]
            self.assertGreater(len(parts), 4)
            self.assertEqual(parts, [node.bag] + [part % k for k in range(1, len(parts))])
            result = verify(*parts)
            self.assertEqual(result.returncode, 0, result.stdout[-2000:])
            found, of_the_push = {}, None
            for path in parts:
                with rosbag.Bag(path) as bag:
                    topics = [topic for topic, _, _ in bag.read_messages()]
                self.assertEqual(topics[:2], ["/long/recording/start", "/long/online_model"])
                if "/long/epoch" in topics:
                    of_the_push = path
                for topic in topics:
                    found[topic] = found.get(topic, 0) + 1
            self.assertEqual(verified(result), sum(count for topic, count in found.items() if topic not in (
                "/long/online_model", "/long/recording/start", "/long/recording/link")))
            # A part that is missing is noticed.
            self.assertNotEqual(of_the_push, parts[0])
            parts.remove(of_the_push)
            result = verify(*parts)
            self.assertEqual(result.returncode, INCOMPLETE)
            self.assertIn("which is not here", result.stdout)

    def test_a_run_that_ends_says_why_and_can_be_revived(self):
        with tempfile.TemporaryDirectory() as directory:
            node = RecordingNode(directory, "ending", model="bouncing_ball", real_time_factor="0")
            ball = Simulator("ending")
            self.assertTrue(wait_until(lambda: ball.get_state().paused), "Zeno")
            with self.assertRaises(rospy.ServiceException):
                ball.unpause_physics()
            answer = ball.step(seconds=1)
            self.assertFalse(answer.success)
            self.assertIn("(Zeno)", answer.message)
            answer = ball.set_state(state=InitialState(names=["z"], positions=[0.4], velocities=[0]))
            self.assertTrue(answer.success, answer.message)
            self.assertTrue(ball.step(seconds=0.4).success)
            node.stop()
            result = verify(node.bag)
            self.assertEqual(result.returncode, 0, result.stdout[-2000:])

    def test_parameters_that_are_refused(self):
        for parameters, reason in (({"publish_clock": "true"}, "/use_sim_time is not"),
                                   ({"real_time_factor": "-1"}, "real_time_factor is -1"),
                                   ({"rate": "0"}, "rate is 0"),
                                   ({"realtime_priority": "100"}, "realtime_priority"),
                                   ({"realtime_priority": "50", "busy_wait": "true"}, "choose one")):
            process = subprocess.run(
                [executable("contact_flow_node"), "__name:=refused", "_online:=true"] +
                ["_{}:={}".format(*item) for item in parameters.items()],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=30)
            for name in parameters:
                rospy.delete_param("/refused/" + name)
            self.assertEqual(process.returncode, 1)
            self.assertIn(reason, process.stdout)

    def test_ends_while_a_client_waits(self):
        with tempfile.TemporaryDirectory() as directory:
            # A block that comes to rest on its plane stays there: this run does not end by itself.
            node = RecordingNode(directory, "waited_for", model="block_on_incline", paused="true", record="false")
            block = Simulator("waited_for")
            failed = []

            def wait():
                try:
                    failed.append(not block.step(seconds=1e6).success)
                except rospy.ServiceException:
                    failed.append(True)
            thread = threading.Thread(target=wait, daemon=True)
            thread.start()
            self.assertTrue(wait_until(lambda: block.get_state().state.t > 1))
            self.assertEqual(failed, [], "it still waits")
            node.stop()
            thread.join(timeout=20)
            self.assertEqual(failed, [True])

    def test_a_recording_that_begins_later_is_an_epoch(self):
        with tempfile.TemporaryDirectory() as directory:
            node = RecordingNode(directory, "late", model="hopping_trot", record="false")
            trot = Simulator("late")
            time.sleep(0.5)
            answer = trot.start_recording(name="later")
            self.assertTrue(answer.success, answer.message)
            self.assertIn("later_online.bag", answer.message)
            time.sleep(1.5)
            answer = trot.stop_recording()
            self.assertTrue(answer.success, answer.message)
            node.stop()
            result = verify(answer.paths[-1])
            self.assertEqual(result.returncode, 0, result.stdout[-2000:])

    def test_play_shows_what_was_live(self):
        with tempfile.TemporaryDirectory() as directory:
            node = RecordingNode(directory, "shown", model="hopping_trot")
            Simulator("shown")
            time.sleep(1.5)
            node.stop()
            with rosbag.Bag(node.bag) as bag:
                live = [m for _, m, _ in bag.read_messages(topics=["/joint_states"])]
                stamps = [t for _, _, t in bag.read_messages()]
            self.assertEqual(stamps, sorted(set(stamps)), "later ones are later")
            played = []
            subscriber = rospy.Subscriber("/joint_states", JointState, played.append, queue_size=1000)
            subprocess.run(["rosbag", "play", "-q", "--clock", "-r", "2", "-d", "1", node.bag],
                           stdout=subprocess.DEVNULL, timeout=60)
            self.assertTrue(wait_until(lambda: len(played) >= len(live)))
            subscriber.unregister()
            self.assertEqual([(m.header.stamp, m.position) for m in played],
                             [(m.header.stamp, m.position) for m in live])

    def test_killed_at_random_instants(self):
        """`rosbag reindex` and verify_bag find every event announced more than a second before."""
        for attempt in range(rospy.get_param("kills")):
            with tempfile.TemporaryDirectory() as directory:
                announced, lock = [], threading.Lock()

                def take(event):
                    with lock:
                        announced.append((time.monotonic(), event.transition.t))

                name = "killed_%d" % attempt
                subscriber = rospy.Subscriber(name + "/events", SimulatorEvent, take)
                node = RecordingNode(directory, name, model="hopping_trot", real_time_factor=2, rate=200)
                Simulator(name)
                self.assertTrue(wait_until(lambda: len(announced) > 2))
                time.sleep(1.2 + 2 * random.random())
                moment = time.monotonic()
                node.stop(signal.SIGKILL)
                subscriber.unregister()
                result = verify(node.bag)
                self.assertEqual(result.returncode, INCOMPLETE, result.stdout[-2000:])
                self.assertIn(" 0 differ, 0 skipped", result.stdout)
                self.assertIn("never closed", result.stdout)
                subprocess.run(["rosbag", "reindex", "-q", node.bag], check=True,
                               stdout=subprocess.DEVNULL, timeout=60)
                again = verify(node.bag)
                self.assertEqual(again.returncode, INCOMPLETE, again.stdout[-2000:])
                self.assertGreaterEqual(verified(again), verified(result) - 1)
                with rosbag.Bag(node.bag) as bag:
                    found = {m.transition.t for _, m, _ in bag.read_messages(
                        topics=["/%s/events" % name])}
                with lock:
                    due = [t for arrival, t in announced if arrival < moment - 1]
                self.assertGreater(len(due), 2)
                self.assertLessEqual(set(due), found)


if __name__ == "__main__":
    rospy.init_node("simulator_recording_test")
    rostest.rosrun("contact_flow", "simulator_recording", SimulatorRecording)
