#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The service check_assumptions, rightly and wrongly asked."""
import math
import unittest

import rospy
import rostest
from client import Client
from contact_flow.msg import InitialState
from contact_flow.srv import CheckAssumptionsResponse as Outcome


class Assumptions(unittest.TestCase):
    def test_soft_legs_are_orthogonal(self):
        answer = Client("soft").check_assumptions()
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, Outcome.OK)
        self.assertTrue(answer.differentiable)
        self.assertEqual(answer.initial.touching, [])
        self.assertEqual(answer.initial.contact_class, "single")
        landing, = answer.transitions
        self.assertAlmostEqual(landing.t, 1, places=6)
        self.assertEqual(landing.touching, ["left_foot", "right_foot"])
        self.assertEqual(landing.contact_class, "orthogonal")
        self.assertEqual(landing.rank, 2)
        self.assertTrue(landing.smooth and landing.qualified)
        self.assertEqual(answer.region_pairs, [])
        self.assertAlmostEqual(answer.margins.approach_speed, 1, places=6)

    def test_rigid_legs_depend_on_the_order(self):
        answer = Client("rigid").check_assumptions(region_samples=50)
        self.assertTrue(answer.success, answer.message)
        self.assertFalse(answer.differentiable)
        self.assertEqual(answer.transitions[0].contact_class, "order-dependent")
        pair, = answer.region_pairs
        self.assertEqual((pair.first, pair.second), ("left_foot", "right_foot"))
        self.assertEqual(pair.met, 50)
        # Both feet stand only without pitch, where the coupling is that of the simultaneous landing.
        self.assertAlmostEqual(pair.largest, answer.transitions[0].couplings[0].largest, places=6)
        self.assertEqual(answer.region_smooth, 50)

    def test_one_foot_after_the_other_is_differentiable_even_when_coupled(self):
        state = InitialState(names=["body_pitch"], positions=[0.1])
        answer = Client("rigid").check_assumptions(state=state)
        self.assertTrue(answer.differentiable)
        self.assertEqual(answer.transitions[1].contact_class, "order-dependent")

    def test_bad_requests_name_field_and_value(self):
        client = Client("soft")
        for request, wanted in (
                (dict(region_q=[0.1]), "region_q has 1 entries"),
                (dict(region_v=[math.nan] * 7), "region_v[0] is nan"),
                (dict(region_q=[-1] * 7), "region_q[0] is -1"),
                (dict(region_samples=20000), "region_samples is 20000"),
                (dict(duration=-1), "duration is -1"),
                (dict(state=InitialState(names=["nose"], positions=[1])), "'nose'")):
            answer = client.check_assumptions(**request)
            self.assertFalse(answer.success)
            self.assertEqual(answer.outcome, Outcome.REFUSED)
            self.assertIn(wanted, answer.message)
        self.assertTrue(client.check_assumptions().success)


if __name__ == "__main__":
    rospy.init_node("assumptions_test")
    rostest.rosrun("contact_flow", "assumptions", "__main__")
