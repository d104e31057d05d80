#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives by inputs and parameters, linearize, quaternions and bilateral constraints by service."""
import unittest

import numpy as np
import rospy
import rostest
from client import Client
from contact_flow.msg import InitialState, InputGrid, RowMajorMatrix


def matrix(m):
    return np.array(m.data).reshape(m.rows, m.cols)


class Variables(unittest.TestCase):
    def test_derivative_by_a_parameter_agrees_with_quotients(self):
        answer = Client("box").compare(by_inputs=True, by_parameters=["restitution", "mass"],
                                       directions=["parameter restitution", "-input torque_x", "roll"])
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.comparison.variables[-2:], ["parameter restitution", "parameter mass"])
        self.assertEqual([c.name for c in answer.comparison.comparisons],
                         ["+parameter restitution", "-input torque_x", "+roll"])
        for comparison in answer.comparison.comparisons:
            # alpha = 1e-6; three bounces of a light box make second derivatives of several thousand
            size = 1 + max(map(abs, comparison.prediction))
            self.assertLess(comparison.errors[4], 1e-2 * size, comparison.name)
            self.assertAlmostEqual(comparison.slope, 1, delta=0.2, msg=comparison.name)
        self.assertGreater(max(map(abs, answer.comparison.comparisons[0].prediction)), 0.1)

    def test_unknown_parameter_is_refused_with_the_nearest(self):
        answer = Client("box").b_derivative(by_parameters=["restitutoin"])
        self.assertFalse(answer.success)
        self.assertIn("restitution", answer.message)

    def test_linearize_free_fall(self):
        duration, m = 0.2, 6
        answer = Client("box").linearize(
            duration=duration,
            input_grid=InputGrid(times=[0, 0.1], values=RowMajorMatrix(data=[0.0] * (2 * m))))
        self.assertTrue(answer.success, answer.message)
        first, second = answer.linearization.intervals
        self.assertEqual((first.t_begin, first.t_end, second.t_end), (0, 0.1, duration))
        A, B = matrix(second.A), matrix(second.B)
        self.assertEqual((A.shape, B.shape), ((12, 12), (12, 6)))
        self.assertAlmostEqual(A[0, 6], 0.1, places=9)            # dx(T)/dvx
        self.assertAlmostEqual(B[2, 2], 0.5 * 0.1 ** 2, places=9)  # dz(T)/d force_z, mass 1
        self.assertTrue(first.is_linear and second.is_linear)

    def test_an_input_grid_pushes_the_box_in_flight(self):
        grid = InputGrid(times=[0, 0.1],
                         values=RowMajorMatrix(data=[0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0]))
        client = Client("box")
        plain = client.simulate(duration=0.2).trajectory
        answer = client.simulate(duration=0.2, input_grid=grid)
        self.assertTrue(answer.success, answer.message)
        pushed = answer.trajectory
        self.assertEqual([list(arc.input) for arc in pushed.arcs], [[0] * 6, [3] + [0] * 5])
        # force_x = 3 N on 1 kg over the last 0.1 s
        self.assertAlmostEqual(pushed.final_q[0] - plain.final_q[0], 0.5 * 3 * 0.1 ** 2, places=9)
        self.assertAlmostEqual(pushed.final_v[0] - plain.final_v[0], 0.3, places=9)
        # The derivative by an input shifts it on every interval.
        answer = client.compare(duration=0.2, input_grid=grid, by_inputs=True,
                                directions=["input force_x"])
        self.assertTrue(answer.success, answer.message)
        self.assertAlmostEqual(answer.comparison.comparisons[0].prediction[0], 0.5 * 0.2 ** 2, places=9)
        self.assertLess(answer.comparison.worst_error, 1e-6)

    def test_input_and_grid_values_exclude_one_another(self):
        answer = Client("box").simulate(
            input=[0.0] * 6, input_grid=InputGrid(values=RowMajorMatrix(data=[0.0] * 6)))
        self.assertFalse(answer.success)
        self.assertIn("input_grid.values", answer.message)

    def test_bad_grid_is_refused(self):
        answer = Client("box").linearize(input_grid=InputGrid(times=[0, 0.2, 0.1]))
        self.assertFalse(answer.success)
        self.assertIn("0.1", answer.message)
        answer = Client("box").simulate(input_grid=InputGrid(times=[0.1, 0.2]))
        self.assertFalse(answer.success)
        self.assertIn("input_grid.times[0] is 0.1", answer.message)

    def test_states_off_the_legs_are_refused_or_projected(self):
        client = Client("jointed")
        state = InitialState(names=["body_pitch"], positions=[0.2])
        answer = client.simulate(state=state)
        self.assertFalse(answer.success)
        self.assertIn("leg", answer.message)
        state.project = True
        answer = client.simulate(state=state)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(len(answer.trajectory.final_q), 7)


if __name__ == "__main__":
    rospy.init_node("variables_test")
    rostest.rosrun("contact_flow", "variables", Variables)
