#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A ball thrown at a ceiling, 1 m up: answers say when it grazes, and when it nearly does."""
import math
import unittest

import rospy
import rostest
from client import Client
from contact_flow.msg import InitialState, ResultWarning, RowMajorMatrix, SimulationOptions
from contact_flow.srv import ComputeBDerivativeResponse as Outcome

TIGHT = SimulationOptions(relative_tolerance=1e-12, absolute_tolerance=1e-12)
CRITICAL = 2 * 9.81  # squared speed that just reaches it


def thrown(squared_speed, **fields):
    state = InitialState(q=[0], v=[math.sqrt(squared_speed)])
    return dict(duration=0.8, state=state, options=TIGHT, **fields)


class Grazing(unittest.TestCase):
    def test_near_misses_and_slow_touchdowns_are_named(self):
        client = Client("ceiling")
        for squared, kind, value in ((CRITICAL * (1 - 1e-7), "near touchdown", 1e-7),
                                     (CRITICAL + 25e-10, "slow touchdown", 5e-5)):
            for samples in (1, 50):
                answer = client.simulate(**thrown(squared, samples=samples))
                self.assertEqual(answer.outcome, Outcome.OK, answer.message)
                self.assertIn("near grazing: ", answer.message)
                self.assertIn("'ceiling'", answer.message)
                warning, = answer.trajectory.near_grazing
                self.assertEqual((warning.kind, warning.constraint), (kind, "ceiling"))
                self.assertAlmostEqual(warning.t, math.sqrt(CRITICAL) / 9.81, delta=1e-5)
                self.assertAlmostEqual(warning.value, value, delta=0.01 * value)
                self.assertLess(warning.value, warning.threshold)
                coded, = answer.warnings
                self.assertEqual((coded.code, coded.t), (ResultWarning.NEAR_GRAZING, warning.t))
                self.assertIn(coded.message, answer.message)
                self.assertEqual(answer.trajectory.warnings, answer.warnings)
            derivative = client.b_derivative(**thrown(squared))
            self.assertEqual(derivative.outcome, Outcome.OK, derivative.message)
            self.assertIn("near grazing: ", derivative.message)
            self.assertEqual(derivative.derivative.near_grazing[0].kind, kind)
            self.assertEqual([w.code for w in derivative.warnings], [ResultWarning.NEAR_GRAZING])

    def test_the_derivative_says_how_far_it_holds(self):
        client = Client("ceiling")
        speed = math.sqrt(CRITICAL)
        for less in (1e-2, 1e-3):
            fields = thrown((speed - less) ** 2, direction_matrix=RowMajorMatrix(data=[0, 1, 0, -1]))
            derivative = client.b_derivative(**fields).derivative
            self.assertAlmostEqual(derivative.radii[0], less, delta=less ** 2)
            self.assertIn("the gap of 'ceiling' closes", derivative.radius_limits[0])
            self.assertGreater(derivative.radii[1], 0.1)
            self.assertEqual(derivative.margins.approach_speed, math.inf)

    def test_grazing_itself_is_an_outcome_and_an_ordinary_run_has_no_warning(self):
        client = Client("ceiling")
        grazed = client.simulate(**thrown(CRITICAL))
        self.assertEqual(grazed.outcome, 0)  # the motion goes on, with a warning
        self.assertIn(Outcome.GRAZING, [warning.code for warning in grazed.warnings])
        self.assertEqual(client.b_derivative(**thrown(CRITICAL)).outcome, Outcome.GRAZING)
        nominal = client.simulate()
        self.assertEqual((nominal.message, nominal.trajectory.near_grazing), ("", []))
        self.assertEqual(nominal.warnings, [])
        derivative = client.b_derivative()
        self.assertEqual((derivative.message, derivative.warnings), ("", []))


if __name__ == "__main__":
    rospy.init_node("grazing_test")
    rostest.rosrun("contact_flow", "grazing", "__main__")
