#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What was answered is on disk: bags after SIGKILL, on a full disk, and under verify_bag."""
import glob
import io
import math
import os
import random
import resource
import shutil
import signal
import struct
import subprocess
import tempfile
import threading
import time
import unittest

import rosbag
import rospy
import rostest
from client import Client, executable, wait_until
from contact_flow.msg import (
    ContactTrajectory, InitialState, InputGrid, ResultWarning, SimulationOptions)
from contact_flow.srv import SimulateTrajectoryResponse

INCOMPLETE = 3


def topics_of(path):
    with rosbag.Bag(path) as bag:
        return {name: info.message_count
                for name, info in bag.get_type_and_topic_info().topics.items()}


def verify(*paths):
    """Exit code and output of verify_bag."""
    done = subprocess.run([executable("verify_bag"), *paths], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, timeout=60)
    return done.returncode, done.stdout.decode()


def rewrite(source, target, change):
    """Copies a bag, with change(topic, message) applied to every message."""
    with rosbag.Bag(source) as old, rosbag.Bag(target, "w") as new:
        for topic, message, stamp, header in old.read_messages(return_connection_header=True):
            change(topic, message)
            new.write(topic, message, stamp, connection_header=header)


def bits(message):
    """The message as it is sent. (A bag has classes of its own, which never compare equal.)"""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def with_change(numbers, i, value):
    return tuple(numbers[:i]) + (value,) + tuple(numbers[i + 1:])


def next_up(number):
    """The next larger double: one bit away."""
    pattern = struct.unpack("<q", struct.pack("<d", number))[0]
    return struct.unpack("<d", struct.pack("<q", pattern + 1))[0]


class Recording(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.mkdtemp()
        self.process = None

    def tearDown(self):
        self.stop()
        shutil.rmtree(self.directory)

    def start(self, *arguments, largest_file=None):
        """A node of our own; largest_file [bytes] plays the full disk."""
        def limit():
            if largest_file:
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))
        self.process = subprocess.Popen(
            [executable("contact_flow_node"), "__name:=recorded",
             "_bag_directory:=" + os.path.join(self.directory, "made", "for", "it"), *arguments],
            preexec_fn=limit)
        return Client("/recorded")

    def stop(self, how=signal.SIGINT):
        if self.process:
            self.process.send_signal(how)
            self.process.wait(timeout=20)
            self.process = None
            # a killed node leaves its services with the master: they must not be taken for the next
            subprocess.run(["rosnode", "cleanup"], input=b"y\n", stdout=subprocess.DEVNULL,
                           timeout=30)
        if rospy.has_param("/recorded"):
            rospy.delete_param("/recorded")

    def test_answered_results_survive_sigkill(self):
        client = self.start()
        path = client.start_recording(name="killed").path
        self.assertTrue(path.endswith("/made/for/it/killed.bag"))
        first = client.simulate()
        second = client.b_derivative(directions=["+body_pitch", "-body_pitch"], all_pieces=True)
        self.process.kill()
        self.assertTrue(first.success and second.success)
        self.assertEqual([first.recorded, second.recorded], [path, path])
        self.assertEqual(topics_of(path), {
            "/recorded/recording/start": 1,
            "/recorded/recording/link": 3,
            "/recorded/model_description": 1,
            "/recorded/record/simulation": 1,
            "/recorded/trajectory": 1,
            "/recorded/mode_sequence": 1,
            "/recorded/record/derivative": 1,
            "/recorded/b_derivative": 1})
        with rosbag.Bag(path) as bag:
            records = {topic: message for topic, message, _ in bag.read_messages()}
        self.assertEqual(bits(records["/recorded/trajectory"]), bits(first.trajectory))
        self.assertEqual(bits(records["/recorded/record/simulation"].result),
                         bits(first.trajectory))
        self.assertEqual(bits(records["/recorded/record/derivative"].result),
                         bits(second.derivative))
        self.assertEqual(records["/recorded/record/derivative"].request.directions,
                         ["+body_pitch", "-body_pitch"])
        code, output = verify(path)
        self.assertEqual(code, INCOMPLETE, output)
        self.assertIn("it was not ended", output)
        self.assertIn("2 verified, 0 differ, 0 skipped: INCOMPLETE, for 1 reasons", output)

    def test_killed_at_any_time_the_bag_is_whole(self):
        draw = random.Random(13)
        for attempt in range(rospy.get_param("kills", 1)):
            self.killed_while_three_ask("often_%d" % attempt, draw.uniform(0.05, 1.2))

    def killed_while_three_ask(self, name, seconds):
        client = self.start()
        path = client.start_recording(name=name).path
        acknowledged = []

        def ask(samples):
            try:
                while client:
                    answer = client.simulate(samples=samples)
                    assert answer.recorded
                    acknowledged.append(len(answer.trajectory.t))
            except (rospy.ServiceException, rospy.exceptions.TransportException):
                pass
        self.assertTrue(client.simulate(samples=100).recorded)
        threads = [threading.Thread(target=ask, args=(samples,)) for samples in (5000, 200, 1000)]
        for thread in threads:
            thread.start()
        time.sleep(seconds)
        self.stop(signal.SIGKILL)
        for thread in threads:
            thread.join(timeout=20)
        paths, kept = sorted(glob.glob(path.replace(".bag", "*.bag")), key=lambda p: (len(p), p)), []
        for part in paths:
            with rosbag.Bag(part) as bag:
                kept += [len(m.result.t) for topic, m, _ in bag.read_messages() if topic.endswith("record/simulation")]
        for length in acknowledged:
            self.assertIn(length, kept, "acknowledged and lost")
            kept.remove(length)
        self.assertLessEqual(len(kept), 1 + len(threads), "the first; written, but killed before the answer")
        code, output = verify(*paths)
        self.assertEqual(code, INCOMPLETE, output)
        self.assertIn("INCOMPLETE, for 1 reasons", output)

    def test_every_kind_of_request_is_verified(self):
        client = self.start("_parameters/stiffness:=30", "_options/relative_tolerance:=1e-10",
                            "_record:=true", "_bag_name:=all")
        path = client.simulate(duration=1.2, samples=33).recorded
        client.b_derivative()
        client.compare(directions=["-body_pitch"], alphas=[1e-3, 1e-4])
        for answer in (client.linearize(input_grid=InputGrid(times=[0, 0.5])),
                       client.check_assumptions(region_samples=5)):
            self.assertTrue(answer.success, answer.message)
            self.assertEqual(answer.recorded, path)
        stopped = client.stop_recording()
        self.assertEqual(stopped.paths, [path])
        self.assertEqual(stopped.results, 5)
        self.assertEqual(client.simulate().recorded, "")
        code, output = verify(path)
        self.assertEqual(code, 0, output)
        self.assertIn("5 verified", output)
        again = client.start_recording(name="all")
        self.assertFalse(again.success)
        self.assertIn("exists", again.message)
        default = client.start_recording()
        self.assertTrue(default.success, default.message)
        self.assertIn("/soft_biped_", default.path)
        self.assertFalse(client.start_recording(name="other").success)

    def test_one_flipped_number_is_found(self):
        client = self.start()
        path = client.start_recording(name="good").path
        client.simulate()
        client.b_derivative(directions=["+body_pitch"])
        self.stop()

        def result(topic, m):
            if topic.endswith("record/simulation"):
                m.result.q.data = with_change(m.result.q.data, 77, next_up(m.result.q.data[77]))

        def derivative(topic, m):
            if topic.endswith("record/derivative"):
                d = m.result.derivatives
                d.data = with_change(d.data, 3, next_up(d.data[3]))

        def request(topic, m):
            if topic.endswith("record/simulation"):
                m.request.duration = 1.4000000001

        def copy(topic, m):
            if topic.endswith("/trajectory"):
                m.final_q = with_change(m.final_q, 3, next_up(m.final_q[3]))

        def model(topic, m):
            if topic.endswith("/model_description"):
                m.parameters[0].value = 1.5

        def nothing(_, __):
            pass

        for change in (result, derivative, request, copy, model):
            changed = os.path.join(self.directory, change.__name__ + ".bag")
            rewrite(path, changed, change)
            code, output = verify(changed)
            self.assertEqual(code, 1, change.__name__ + "\n" + output)
            self.assertIn("DIFFERS", output)
            # together with a good one, too
            self.assertEqual(verify(path, changed)[0], 1)
        same = os.path.join(self.directory, "same.bag")
        rewrite(path, same, nothing)
        self.assertEqual(verify(same)[0], 0)

    def test_warnings_are_recorded_and_verified(self):
        client = self.start("_model:=ceiling")
        path = client.start_recording(name="warned").path
        # 0.1 um below the ceiling, 1 m up
        state = InitialState(q=[0], v=[math.sqrt(2 * 9.81 * (1 - 1e-7))])
        answer = client.simulate(state=state, duration=0.8)
        self.assertEqual([w.code for w in answer.warnings], [ResultWarning.NEAR_GRAZING])
        self.assertEqual(client.b_derivative(state=state, duration=0.8).warnings, answer.warnings)
        self.stop()
        with rosbag.Bag(path) as bag:
            record = next(m for topic, m, _ in bag.read_messages() if topic.endswith("/trajectory"))
        self.assertEqual([bits(w) for w in record.warnings], [bits(w) for w in answer.warnings])
        self.assertEqual(verify(path)[0], 0)

        def silence(topic, m):
            if topic.endswith("record/simulation"):
                m.result.warnings = []
        silent = os.path.join(self.directory, "silent.bag")
        rewrite(path, silent, silence)
        code, output = verify(silent)
        self.assertEqual(code, 1)
        self.assertIn("DIFFERS", output)

    def test_verify_bag_is_not_content_with_nothing(self):
        empty = os.path.join(self.directory, "empty.bag")
        rosbag.Bag(empty, "w").close()
        self.assertEqual(verify(empty)[0], 1)
        self.assertEqual(verify(os.path.join(self.directory, "missing.bag"))[0], 1)
        self.assertEqual(verify()[0], 2)
        code, output = verify("--help")
        self.assertEqual(code, 0)
        self.assertIn("Usage", output)

    def test_full_disk_is_said_and_survived(self):
        client = self.start(largest_file=100000)
        path = client.start_recording(name="full").path
        self.assertTrue(client.simulate(samples=10).success)
        answer = client.simulate(samples=5000)
        self.assertFalse(answer.success)
        self.assertIn("NOT RECORDED", answer.message)
        self.assertIn(path, answer.message)
        self.assertEqual(answer.recorded, "")
        self.assertEqual(answer.outcome, SimulateTrajectoryResponse.OK)
        self.assertGreater(len(answer.trajectory.t), 5000)  # the result itself is there
        self.assertIn("disk full", answer.message)
        self.assertEqual(verify(path)[0], INCOMPLETE)       # and the bag is as it was
        self.assertTrue(client.simulate(samples=10).success)
        self.assertEqual(topics_of(path)["/recorded/record/simulation"], 2)
        self.assertEqual(os.listdir(os.path.dirname(path)), ["full.bag"])

    def test_long_recordings_are_split(self):
        client = self.start()
        client.start_recording(name="long")
        for _ in range(3):
            self.assertTrue(client.simulate(samples=40000).success)
        stopped = client.stop_recording()
        self.assertEqual([os.path.basename(p) for p in stopped.paths],
                         ["long.bag", "long_1.bag", "long_2.bag"])
        self.assertEqual(verify(*stopped.paths)[0], 0)
        for path in stopped.paths:
            self.assertEqual(verify(path)[0], INCOMPLETE)

    def test_simulated_time_that_has_not_begun(self):
        rospy.set_param("/use_sim_time", True)
        try:
            client = self.start("_record:=true")
        finally:
            rospy.delete_param("/use_sim_time")
        answer = client.simulate()
        self.assertTrue(answer.success, answer.message)
        self.assertFalse(answer.trajectory.header.stamp.is_zero())
        self.assertTrue(client.stop_recording().success)
        self.assertEqual(verify(answer.recorded)[0], 0)

    def test_a_long_request_ends_with_the_node(self):
        client = self.start("_model:=hopping_trot", "_parameters/push_strain:=0.2")
        answers = []

        def ask():
            try:
                answers.append(client.simulate(duration=1e6, samples=1, options=SimulationOptions(
                    max_steps=10**9, max_events=10**6, max_seconds=3600)))
            except rospy.ServiceException:
                answers.append(None)

        thread = threading.Thread(target=ask)
        thread.start()
        rospy.sleep(1)
        self.assertEqual(answers, [])
        start = time.time()
        self.stop()
        self.assertLess(time.time() - start, 10)
        thread.join(timeout=10)
        self.assertFalse(thread.is_alive())

    def test_play_feeds_subscribers(self):
        client = self.start()
        path = client.start_recording(name="played").path
        answer = client.simulate()
        self.stop()
        got = []
        subscriber = rospy.Subscriber("/recorded/trajectory", ContactTrajectory, got.append)
        subprocess.run(["rosbag", "play", "-q", "-d", "1", path], timeout=60, check=True,
                       stdout=subprocess.DEVNULL)
        self.assertTrue(wait_until(lambda: got))
        subscriber.unregister()
        got[0].header.seq = 0
        self.assertEqual(got[0], answer.trajectory)


if __name__ == "__main__":
    rospy.init_node("recording_test")
    rostest.rosrun("contact_flow", "recording", "__main__")
