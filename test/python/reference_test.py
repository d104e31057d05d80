#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The reference cases of the C++ tests, to the same digits: events, modes, states, derivatives."""
import unittest

import contact_flow as cf
import case
from case import largest

NAMES = ["ball_in_corner", "double_pendulum_simultaneous", "hopping_trot_stable",
         "hopping_trot_unstable", "rigid_biped_left_first", "rigid_biped_right_first",
         "rigid_biped_simultaneous", "soft_biped_decoupled", "soft_biped_simultaneous",
         "soft_biped_tilted", "wall_and_floor"]
#: as in test/derivative/reference_test.cc: tolerance, then allowed error of event times, states and
#: derivatives (relative to the largest entry of all of the case)
TIGHT = (1e-12, 1e-11, 1e-10, 1e-8)
DEFAULT = (1e-9, 1e-7, 1e-7, 1e-6)


class Reference(unittest.TestCase):
    def check(self, name, accuracy):
        tolerance, time, state, slope = accuracy
        data = case.reference(name)
        system = cf.Model(data["model"], **data["parameters"])
        self.assertEqual(tuple(data["coordinates"]), system.coordinates)
        run = system.simulate(case.state(data["initial_state"]), data["horizon"],
                              relative_tolerance=tolerance, absolute_tolerance=tolerance)
        self.assertTrue(run.status, run.status)
        self.assertEqual(len(data["event_times"]), len(run.events))
        for wanted, event in zip(data["event_times"], run.events):
            self.assertAlmostEqual(wanted, event.t, delta=time)
        self.assertEqual([tuple(mode) for mode in data["mode_sequence"]], run.modes)
        self.assertLessEqual(largest(run.final_state - case.state(data["final_state"])), state)
        entries = data.get("directional_derivatives", [])
        if not entries:
            return 0, 0.0
        B = run.derivative(tolerance=tolerance)
        self.assertTrue(B.status, B.status)
        pieces = B.pieces()
        scale, worst = max(largest(entry["derivative"]) for entry in entries), 0.0
        for entry in entries:
            for value in (B(entry["direction"]), pieces(entry["direction"])):
                worst = max(worst, largest(value - entry["derivative"]) / scale)
        self.assertLessEqual(worst, slope)
        return len(entries), worst

    def test_tight(self):
        checked = []
        for name in NAMES:
            with self.subTest(name):
                checked.append(self.check(name, TIGHT))
        directions = sum(count for count, _ in checked)
        print("%d cases, %d directions: derivatives within %.1e" % (len(checked), directions, max(w for _, w in checked)))
        self.assertGreater(directions, 100)

    def test_default(self):
        for name in NAMES:
            with self.subTest(name):
                self.check(name, DEFAULT)

    def test_refused_where_the_order_decides(self):
        data = case.reference("rigid_biped_simultaneous")
        run = cf.Model(data["model"], **data["parameters"]).simulate(
            case.state(data["initial_state"]), data["horizon"],
            relative_tolerance=1e-12, absolute_tolerance=1e-12)
        B = run.derivative()
        self.assertFalse(B.status)
        self.assertEqual("discontinuous", B.status.outcome)
        self.assertIn("left_foot", B.status.message)
        with self.assertRaisesRegex(cf.NoDerivative, "discontinuous"):
            B("+body_pitch")
        outcomes = B.outcomes(continued=True)
        self.assertEqual([("left_foot", "right_foot"), ("right_foot", "left_foot")],
                         [outcome["order"] for outcome in outcomes])
        self.assertEqual([("right_foot",), ("left_foot",)],
                         [outcome["mode_after"] for outcome in outcomes])
        # Each order's velocity is the limit of the runs on its side, which are ~1e-6 rad away.
        for name, outcome in (("rigid_biped_left_first", outcomes[0]),
                              ("rigid_biped_right_first", outcomes[1])):
            near = case.reference(name)
            landed = cf.Model(near["model"], **near["parameters"]).simulate(
                case.state(near["initial_state"]), near["horizon"],
                relative_tolerance=1e-12, absolute_tolerance=1e-12).events[-1].x_plus[3:]
            self.assertLessEqual(largest(landed - outcome["v_plus"]), 1e-5)
            self.assertLessEqual(largest(case.state(near["final_state"]) - outcome["final_state"]), 1e-5)


if __name__ == "__main__":
    case.main()
