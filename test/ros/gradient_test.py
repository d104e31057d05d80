#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""gradient: on the piece of a direction, refused at a kink without one. Recorded in analyses_test.py."""
import unittest

import rospy
import rostest
from client import Client, matrix
from contact_flow.msg import RowMajorMatrix


class Gradient(unittest.TestCase):
    def test_is_the_derivative_on_the_piece_of_the_direction(self):
        client = Client("pendulum")
        refused = client.gradient(outcomes=["elbow"], targets=[2.03])
        self.assertTrue(refused.success, refused.message)
        self.assertEqual(17, refused.outcome)
        self.assertIn("elbow_stop", refused.message)
        slopes = []
        for sign in (1, -1):
            name = "+shoulder" if sign > 0 else "-shoulder"
            answer = client.gradient(outcomes=["elbow"], targets=[2.03], direction=[sign, 0, 0, 0])
            self.assertEqual(0, answer.outcome, answer.message)
            result = answer.result
            self.assertFalse(result.whole)
            derivative = client.b_derivative(directions=[name]).derivative
            elbow = client.simulate().trajectory.final_q[1]
            # ½ (e − 2.03)² along the direction, to the tolerance of the tangents.
            slope = (elbow - 2.03) * matrix(derivative.derivatives)[0][1]
            self.assertAlmostEqual(slope, result.along, delta=1e-8)
            self.assertAlmostEqual(sign * result.by_state[0], result.along, delta=1e-15)
            self.assertLess(result.law, 1e-9)
            slopes.append(result.along)
        self.assertGreater(abs(slopes[0] + slopes[1]), 0.01)  # a kink

    def test_wrong_requests_are_refused(self):
        client = Client("pendulum")
        for fields, part in (
                ({}, "nothing costs anything"),
                ({"outcomes": ["elbw"]}, "elbow"),
                ({"outcomes": ["elbow"], "targets": [1, 2]}, "targets"),
                ({"outcomes": ["elbow"], "weights": [-1]}, "weights[0]"),
                ({"outcomes": ["elbow"], "direction": [1]}, "direction has 1 entries, expected 4"),
                ({"outcomes": ["elbow"], "direction_inputs": RowMajorMatrix(rows=2, cols=2, data=[1] * 4)},
                 "direction_inputs is 2 × 2, expected 1 × 2")):
            answer = client.gradient(**fields)
            self.assertFalse(answer.success, fields)
            self.assertEqual(answer.outcome, 255)
            self.assertIn(part, answer.message)


if __name__ == "__main__":
    rospy.init_node("gradient_test")
    rostest.rosrun("contact_flow", "gradient", "__main__")
