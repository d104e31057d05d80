#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Return maps of walkers, whose steps end with the legs exchanged and further on."""
import math
import unittest

import numpy as np
import rospy
import rostest
from client import Client, matrix
from contact_flow.msg import InitialState, PoincareRequest, ReturnSection

STEP = {"kind": "touchdown", "name": "right_foot", "exchange": ["left_leg", "right_leg"],
        "travel": ["hip_x"]}


class Walkers(unittest.TestCase):
    def test_eigenvalues_of_a_step(self):
        client = Client("walker")
        answer = client.poincare_map(section=ReturnSection(**STEP))
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, 0, answer.message)
        result = answer.result
        self.assertAlmostEqual(result.time, 0.734346391, places=8)
        self.assertLess(result.distance, 1e-8)
        values = sorted(np.linalg.eigvals(matrix(result.reduced[0].matrix)),
                        key=lambda z: (-round(abs(z), 6), -z.imag))
        for value, known in zip(values, (-0.199726 + 0.544476j, -0.199726 - 0.544476j, 0.131573)):
            self.assertLess(abs(value - known), 2e-6)
        answer = client.assess_stability(
            return_map=PoincareRequest(section=ReturnSection(**STEP)))
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, 0, answer.message)

    def test_a_wheel_turns_by_a_spoke(self):
        answer = Client("wheel").poincare_map(section=ReturnSection(
            kind="touchdown", name="spoke_2", shifted=["angle"], shift=[-math.pi / 4],
            travel=["hub_x"]))
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, 0, answer.message)
        ratio = (math.cos(math.pi / 4) + 1e-3) / (1 + 1e-3)  # inertia 1e-3 of mass × length²
        self.assertAlmostEqual(matrix(answer.result.reduced[0].matrix)[0, 0], ratio**2, places=9)

    def test_what_is_no_symmetry_is_refused(self):
        client = Client("walker")
        for change, part in (
                ({"exchange": ["left_leg"]}, "section.exchange has 1 entries"),
                ({"exchange": ["left_leg", "right_lg"]}, "section.exchange[1]"),
                ({"exchange": ["left_leg", "left_leg"]}, "cannot change places"),
                ({"shifted": ["hip_x"]}, "section.shift has 0 entries"),
                ({"shifted": ["hip_x"], "shift": [math.nan]}, "section.shift"),
                ({"travel": ["hip"]}, "section.travel[0]")):
            answer = client.poincare_map(section=ReturnSection(**{**STEP, **change}))
            self.assertFalse(answer.success, change)
            self.assertEqual(answer.outcome, 255)
            self.assertIn(part, answer.message)
        moved = client.poincare_map(section=ReturnSection(**{**STEP, "travel": ["hip_z"]}),
                                    state=InitialState(v=[0.9 * v for v in (
                                        1.0525072249, 0.2924558925, -1.0923835899, -0.3773739489)]))
        self.assertNotEqual(moved.outcome, 0)
        self.assertIn("symmetry", moved.message)


if __name__ == "__main__":
    rospy.init_node("walkers_test")
    rostest.rosrun("contact_flow", "walkers", "__main__")
