#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every service of an online node at once while recordings start and stop: what two ordinary clients did to it, and
more of them. Run by scripts/thread_sanitizer, too."""
import glob
import itertools
import os
import random
import tempfile
import threading
import time
import unittest

import rosbag
import rospy
import rostest
from client import SERVICES as ANSWERS
from client import Client
from contact_flow.msg import InitialState, PoincareRequest, ReturnSection
from simulator_client import RecordingNode, Simulator

# roscpp closes a connection now and then: before its answer is read (https://github.com/ros/ros_comm/issues/1976), or
# before its header is, where the socket has the number of one that was closed at that moment (docs/limits.md).
DROPPED = ("transport error completing", "terminated before handshake header received")
APEX = ReturnSection(kind="apex", name="v_z")
CALLS = {
    "simulate": dict(duration=0.1),
    "b_derivative": dict(duration=0.1),
    "compare": dict(duration=0.05, directions=["+x"], alphas=[1e-3]),
    "check_assumptions": dict(duration=0.1),
    "linearize": dict(duration=0.1),
    "poincare_map": dict(section=APEX, horizon=0.2),
    "assess_stability": dict(return_map=PoincareRequest(section=APEX, horizon=0.2)),
    "find_stabilizing_feedback": dict(return_map=PoincareRequest(section=APEX, horizon=0.2)),
    "assess_controllability": dict(duration=0.1),
    "propagate_covariance": dict(duration=0.1, deviations=[0.01] * 12),
    "gradient": dict(duration=0.1, outcomes=["z"]),
    "describe_model": {},
    "set_state": dict(state=InitialState(names=["z"], positions=[2])),
    "get_state": {},
    "set_input": dict(values=[]),
    "apply_impulse": dict(names=["x"], impulse=[1e-3]),
    "set_parameters": dict(names=["mass"], values=[1.5]),
    "mark": dict(directions=["+x"], project_directions=True),
    "predict": dict(horizon=0.02, directions=["+x"]),
    "step": dict(seconds=0.001),
    "pause_physics": {},
    "unpause_physics": {},
    "reset_simulation": {},
    "reset_world": {},
}


def was_dropped(error):
    return any(text in str(error) for text in DROPPED)


class ServiceStress(unittest.TestCase):
    def test_recordings_come_and_go(self):
        with tempfile.TemporaryDirectory() as directory:
            node = RecordingNode(directory, "served", model="falling_box", record="false", rate=200, threads=8,
                                 **{"options/complete_zeno": "true"})
            try:
                answered, started = self.stress(node)
            finally:
                node.stop()
            self.assertEqual(node.process.returncode, 0)
            for name in CALLS:
                self.assertIn(name, answered)
            self.assertGreater(started, 3)
            bags = glob.glob(os.path.join(directory, "*.bag"))
            self.assertGreaterEqual(len(bags), 2 * started)
            for path in bags:
                with rosbag.Bag(path) as bag:  # without an index this throws
                    self.assertGreater(bag.get_message_count(), 0)

    def stress(self, node):
        end = time.time() + rospy.get_param("~seconds", 15)
        wrong, dropped, answered, started = [], [], set(), [0]

        def client(number):
            dice = random.Random(number)
            both = (Client(node.name), Simulator(node.name))
            try:
                while time.time() < end and node.process.poll() is None:
                    name = dice.choice(sorted(CALLS))
                    service = getattr(both[name not in ANSWERS], name)
                    try:
                        service(**CALLS[name])
                    except rospy.ServiceException as error:
                        if was_dropped(error):
                            dropped.append(name)
                            continue
                        if "unpause_physics" not in str(error):
                            raise
                    answered.add(name)
            except Exception as error:  # pylint: disable=broad-except
                wrong.append("%s: %s" % (type(error).__name__, error))

        def recorder():
            one = Client(node.name)
            parts = itertools.count()
            sure = True  # what is recorded: not behind an answer that was dropped
            try:
                while time.time() < end and node.process.poll() is None:
                    try:
                        answer = one.start_recording(name="part_%d" % next(parts))
                        self.assertTrue(answer.success or not sure, answer.message)
                        answer = one.stop_recording()
                        self.assertTrue(answer.success or not sure, answer.message)
                    except rospy.ServiceException as error:
                        if not was_dropped(error):
                            raise
                        dropped.append("recording")
                        sure = False
                        continue
                    started[0] += sure
                    sure = True
            except Exception as error:  # pylint: disable=broad-except
                wrong.append("recorder: %s" % error)

        threads = [threading.Thread(target=client, args=(k,), daemon=True) for k in range(6)]
        threads.append(threading.Thread(target=recorder, daemon=True))
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(timeout=max(0, end + 60 - time.time()))
        self.assertIsNone(node.process.poll(), "the node has ended: %s" % wrong)
        self.assertFalse([t for t in threads if t.is_alive()], "clients that wait for ever")
        self.assertEqual(wrong, [])
        self.assertLess(len(dropped), 5, dropped)
        return answered, started[0]


if __name__ == "__main__":
    rospy.init_node("service_stress_test")
    rostest.rosrun("contact_flow", "service_stress", ServiceStress)
