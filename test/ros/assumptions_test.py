#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The service check_assumptions, rightly and wrongly asked."""
import math
import unittest

import rospy
import rostest
from client import Client
from contact_flow.msg import InitialState, ResultWarning
from contact_flow.srv import CheckAssumptionsResponse as Outcome


class Assumptions(unittest.TestCase):
    def test_soft_legs_are_orthogonal(self):
        answer = Client("soft").check_assumptions()
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, Outcome.OK)
        self.assertTrue(answer.report.differentiable)
        self.assertEqual(answer.report.initial.touching, [])
        self.assertEqual(answer.report.initial.contact_class, "single")
        landing, = answer.report.transitions
        self.assertAlmostEqual(landing.t, 1, places=6)
        self.assertEqual(landing.touching, ["left_foot", "right_foot"])
        self.assertEqual(landing.contact_class, "orthogonal")
        self.assertEqual(landing.rank, 2)
        self.assertTrue(landing.smooth and landing.qualified)
        # A foot that has landed pushes through its leg: the other one's landing bends the outcome.
        self.assertGreater(landing.modularity_defect, 0.1)
        self.assertEqual(answer.report.region_pairs, [])
        self.assertAlmostEqual(answer.report.margins.approach_speed, 1, places=6)

    def test_rigid_legs_depend_on_the_order(self):
        answer = Client("rigid").check_assumptions(region_samples=50)
        self.assertTrue(answer.success, answer.message)
        self.assertFalse(answer.report.differentiable)
        self.assertEqual(answer.report.transitions[0].contact_class, "order-dependent")
        self.assertTrue(math.isnan(answer.report.transitions[0].modularity_defect))
        pair, = answer.report.region_pairs
        self.assertEqual((pair.first, pair.second), ("left_foot", "right_foot"))
        self.assertEqual(pair.met, 50)
        # Both feet stand only without pitch, where the coupling is that of the simultaneous landing.
        self.assertAlmostEqual(pair.largest, answer.report.transitions[0].couplings[0].largest, places=6)
        self.assertEqual(answer.report.region_smooth, 50)

    def test_one_foot_after_the_other_is_differentiable_even_when_coupled(self):
        state = InitialState(names=["body_pitch"], positions=[0.1])
        answer = Client("rigid").check_assumptions(state=state)
        self.assertTrue(answer.report.differentiable)
        self.assertEqual(answer.report.transitions[1].contact_class, "order-dependent")

    def test_what_becomes_of_a_contact_whose_force_jumps(self):
        # The forces that config/damped_plate*.yaml state, exact to the speeds at the impact (1e-9).
        for node, fate, selections, forces in (
                ("plate", "regained", "first order only", (0.6, -1.8, 3.6, 1.2)),
                ("heavy_plate", "keeps", "smooth", (3.6, 1.2, 6.6, 4.2)),
                ("light_plate", "released", "smooth", (3.6, 1.2, 0.6, -1.8))):
            answer = Client(node).check_assumptions()
            self.assertTrue(answer.success, answer.message)
            self.assertTrue(answer.report.differentiable)
            meeting = answer.report.transitions[0]
            self.assertEqual(meeting.selections, selections)
            table, = meeting.force_jumps
            self.assertEqual((table.constraint, table.fate), ("table", fate))
            self.assertEqual([stage.names for stage in table.stages],
                             [[], ["first_stop"], ["second_stop"], ["first_stop", "second_stop"]])
            for force, wanted in zip(table.forces, forces):
                self.assertAlmostEqual(force, wanted, places=7)
            self.assertEqual("'table' is regained" in answer.message, fate == "regained")
            codes = [ResultWarning.FIRST_ORDER_ONLY] if fate == "regained" else []
            self.assertEqual([w.code for w in answer.warnings], codes)
            self.assertTrue(all(w.t == meeting.t for w in answer.warnings))
        rigid = Client("rigid").check_assumptions().report.transitions[0]
        self.assertEqual((rigid.selections, rigid.force_jumps), ("not computed", []))

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
