#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""find_stabilizing_feedback: a law with its certificate, the returns under it, what is refused; recorded and verified."""
import os
import subprocess
import unittest

import numpy as np
import rospy
import rostest
from analyses_test import APEX, FEET, value
from client import Client, executable, matrix
from contact_flow.msg import InitialState, PoincareRequest, ReturnSection, SimulationOptions


class Feedbacks(unittest.TestCase):
    REQUEST = PoincareRequest(section=APEX, translation=FEET)

    def test_the_narrow_trot_is_made_stable(self):
        client = Client("steered")
        self.assertEqual(client.assess_stability(return_map=self.REQUEST).outcome, 1)
        answer = client.find_stabilizing_feedback(return_map=self.REQUEST, piecewise=True)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, 0, answer.message)
        found = answer.result
        self.assertTrue(found.verified)
        self.assertEqual(found.inputs, ["pitch_torque"])
        self.assertAlmostEqual(found.rate, 0.299866, places=5)
        self.assertLess(found.distance, 1e-9)
        # Its certificate is one of assess_stability, for the loop that it closes.
        again = client.assess_stability(map=found.closed, certificate=found.certificate)
        self.assertEqual((again.outcome, again.result.verified), (0, True), again.message)
        # The loop is what returns do under the law.
        basis, x = matrix(found.basis), np.array(found.q + found.v)
        for z in np.eye(basis.shape[1])[:4]:
            for sign in (1, -1):
                z = 1e-6 * sign * z / np.linalg.norm(z)
                start = x + basis @ z
                u = np.array(found.input) + value(found.law, z)
                moved = client.poincare_map(section=APEX, state=InitialState(q=start[:7], v=start[7:]),
                                            input=list(u)).result
                self.assertLess(np.linalg.norm(basis.T @ (np.array(moved.q + moved.v) - x) - value(found.closed, z)), 1e-8)

    def test_without_a_law(self):
        answer = Client("steered").find_stabilizing_feedback(
            return_map=PoincareRequest(section=APEX, translation=["body_x"]))
        self.assertEqual((answer.success, answer.outcome), (True, 3))
        self.assertIn("neutral directions are none", answer.message)
        never = PoincareRequest(section=ReturnSection(kind="coordinate", name="body_z", value=50), horizon=1.0)
        answer = Client("steered").find_stabilizing_feedback(return_map=never)
        self.assertEqual((answer.success, answer.outcome), (True, 3))
        late = PoincareRequest(section=APEX, translation=FEET, options=SimulationOptions(max_seconds=1e-3))
        answer = Client("steered").find_stabilizing_feedback(return_map=late)
        self.assertEqual((answer.success, answer.outcome), (True, 6), answer.message)

    def test_wrong_requests_are_refused(self):
        for name, fields, part in (
                ("wide", {"return_map": self.REQUEST}, "'hopping_trot' has none"),
                ("steered", {}, "section.name"),
                ("steered", {"return_map": self.REQUEST, "inputs": ["pitch_torqe"]}, "inputs[0]"),
                ("steered", {"return_map": self.REQUEST, "inputs": ["pitch_torque"] * 2}, "second time"),
                ("steered", {"return_map": self.REQUEST, "good_enough": -1.0}, "good_enough"),
                ("steered", {"return_map": self.REQUEST, "margin": 0.7}, "margin")):
            answer = Client(name).find_stabilizing_feedback(**fields)
            self.assertFalse(answer.success, fields)
            self.assertEqual(answer.outcome, 255)
            self.assertIn(part, answer.message)

    def test_recorded_and_verified(self):
        client = Client("steered")
        client.start_recording(name="feedback")
        recorded = client.find_stabilizing_feedback(return_map=self.REQUEST, piecewise=True).recorded
        path, = client.stop_recording().paths
        self.addCleanup(os.remove, path)
        self.assertEqual(recorded, path)
        done = subprocess.run([executable("verify_bag"), path], stdout=subprocess.PIPE, timeout=60)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("1 verified, 0 differ, 0 skipped", done.stdout.decode())


if __name__ == "__main__":
    rospy.init_node("feedback_test")
    rostest.rosrun("contact_flow", "feedback", "__main__")
