#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Policies: bounds of some inputs alone, and what their tracker need not be told."""
import pickle
import unittest

import numpy as np

import contact_flow as cf
import case


class PolicyDetails(unittest.TestCase):
    def test_bounds_of_some_inputs_alone(self):
        """A bound by name leaves the other input unbounded, in the policy, as text and in a search."""
        leg = cf.Model("double_pendulum")
        run = leg.simulate(duration=0.3, inputs=[0.5, -0.5])
        for bounds in ({"upper": {"shoulder_torque": 3}}, {"lower": {"shoulder_torque": -3}}):
            policy = run.policy(**bounds)
            for each in policy, pickle.loads(pickle.dumps(policy)):
                np.testing.assert_allclose(each.tracker().input(0.1, run.x(0.1)), [0.5, -0.5], atol=1e-4)
        self.assertIn("upper: [3, .inf]", run.policy(upper={"shoulder_torque": 3}).text)
        found = leg.optimize_trajectory(
            cf.Grid([0, 0.05], np.zeros((2, 2))), {}, duration=0.1, effort=[1, 1], input_reference=[0.3, 0.2],
            upper={"shoulder_torque": 0.1})
        np.testing.assert_allclose(found.inputs.u, [[0.1, 0.2], [0.1, 0.2]], atol=1e-6)

    def test_observations_of_nothing(self):
        """As of events at which the input alone changes, with the mode that holds."""
        ball = cf.Model("driven_ball")
        policy = ball.simulate([1.0, 0.0], 0.8, [0.0]).policy()
        tracker, hit = policy.tracker(), policy.phases[0]["t_end"]
        tracker.observe(hit - 0.05, (), (), ())
        self.assertEqual((0, []), (tracker.phase, tracker.events))

    def test_knots_of_references_come_by_themselves(self):
        """Nothing is fed back on the reference itself, whoever is told of its knots, or not."""
        cart = cf.Robot.from_strings(
            '<robot name="r"><link name="world"/><link name="cart"><inertial><mass value="1"/><inertia ixx="1" ixy="0" '
            'ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link><joint name="x" type="prismatic"><parent link="world"/>'
            '<child link="cart"/><axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="99" velocity="99"/></joint></robot>',
            "{base: fixed, gravity: 0, efforts: {e: {kind: track, joint: x, feed_forward: f, stiffness: 100, damping: 20, "
            "reference: {kind: linear, times: [0, 0.2, 0.4], values: [0, 0.2, 0]}}}}")
        start = {"x": 0.0, "d/dt x": 1.0}
        run = cart.simulate(start, 0.6, cf.Grid([0, 0.2, 0.4], np.zeros((3, 1))), relative_tolerance=1e-10,
                            absolute_tolerance=1e-12)
        policy = run.policy({"x": 1000, "d/dt x": 10}, [0.01])
        self.assertEqual(1, len(policy.phases))
        for told in "nothing", "events", "modes", "switched":
            tracker, flow = policy.tracker(), cart.online(start, [0.0], relative_tolerance=1e-10, absolute_tolerance=1e-12)
            switched = []
            for k in range(600):
                while True:
                    event = flow.advance_to(1e-3 * k)
                    if event is None:
                        break
                    switched += event["switched"]
                    if told == "events":
                        tracker.observe(event["t"], event["activated"], event["released"])
                    elif told == "modes":
                        tracker.observe(event["t"], event["activated"], event["released"], event["mode_after"])
                    elif told == "switched":
                        tracker.observe(event["t"], event["switched"])
                u = tracker.input(1e-3 * k, flow.x)
                self.assertLess(abs(u[0]), 1e-6, (told, k))
                flow.set_input(u)
            self.assertEqual(([], ["knot_1", "knot_2"]), (tracker.events, switched), told)


if __name__ == "__main__":
    case.main()
