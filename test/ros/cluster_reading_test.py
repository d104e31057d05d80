#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Events that a wide simultaneity_tolerance merges: both readings; and the errors of answers."""
import unittest

import numpy
import rospy
import rostest
from client import Client, matrix
from contact_flow.msg import InitialState, SimulationOptions
from contact_flow.srv import ComputeBDerivativeResponse as Outcome

HIGHER = 3e-7  # [m] by which one of four feet lands later, some 1e-7 s
FOOT = "outer_left_foot_z"


class ClusterReading(unittest.TestCase):
    def setUp(self):
        self.client = Client("legged_table")
        model = self.client.describe_model().description
        q = list(model.nominal_q)
        q[model.coordinates.index(FOOT)] += HIGHER
        self.state = InitialState(q=q, v=model.nominal_v)

    def answer(self, tolerance):
        answer = self.client.b_derivative(
            state=self.state, directions=["+" + FOOT, "-" + FOOT],
            options=SimulationOptions(simultaneity_tolerance=tolerance))
        self.assertEqual(answer.outcome, Outcome.OK, answer.message)
        return answer.derivative

    def test_both_readings_of_merged_events(self):
        merged, told = self.answer(1e-6), self.answer(0)
        self.assertEqual(len(merged.modes), 2)
        self.assertGreater(len(told.modes), 2)
        cluster, in_order = matrix(merged.derivatives), matrix(merged.in_order)
        # Upwards the foot lands last in any case; downwards it is the first to land, from HIGHER on.
        self.assertEqual(merged.inner_radii[0], 0)
        self.assertAlmostEqual(merged.inner_radii[1], HIGHER, delta=1e-3 * HIGHER)
        numpy.testing.assert_allclose(in_order[0], cluster[0], atol=1e-9)
        self.assertGreater(numpy.abs(in_order[1] - cluster[1]).max(), 1e-2)
        # In order is what the run whose events are told apart follows, up to ρ being off by HIGHER.
        numpy.testing.assert_allclose(in_order, matrix(told.derivatives), atol=1e-4)
        self.assertEqual(list(told.inner_radii), [0, 0])

    def test_answers_estimate_their_errors(self):
        loose = self.answer(0)
        self.assertEqual([len(loose.final_error), len(loose.derivative_errors)], [12, 2])
        self.assertGreater(max(loose.final_error), 0)
        self.assertLess(max(loose.final_error), 1e-6)
        self.assertGreater(max(loose.derivative_errors), 0)
        self.assertLess(max(loose.derivative_errors), 1e-4)
        interval, = self.client.linearize(state=self.state).linearization.intervals
        # The errors that cost nothing are larger than those that a second run measures.
        self.assertGreater(max(interval.final_error), max(loose.final_error))
        self.assertLess(max(interval.final_error), 1e-6)
        self.assertGreater(interval.derivative_error, 0)

    def test_compare_knows_the_error_of_the_prediction(self):
        answer = self.client.compare(state=self.state, directions=["+" + FOOT], alphas=[1e-3, 1e-4])
        self.assertEqual(answer.outcome, Outcome.OK, answer.message)
        comparison, = answer.comparison.comparisons
        expected = self.client.b_derivative(state=self.state, directions=["+" + FOOT]).derivative
        self.assertEqual(comparison.prediction_error, expected.derivative_errors[0])


if __name__ == "__main__":
    rospy.init_node("cluster_reading_test")
    rostest.rosrun("contact_flow", "cluster_reading", "__main__")
