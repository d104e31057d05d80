#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Models of one's own in C++, from a library that Python loads; they stick and slip."""
import ctypes
import os
import unittest

import numpy as np

import contact_flow as cf
import case
from case import largest

LIBRARY = os.environ.get("CONTACT_FLOW_TEST_MODELS", "")
NAMES = ["forced_stick_slip", "incline_stop", "noslip_liftoff", "puck_curve", "slip_reversal"]


@unittest.skipUnless(os.path.exists(LIBRARY), "the library of models is not built")
class Friction(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        ctypes.CDLL(LIBRARY)

    def test_the_models_are_there(self):
        self.assertLessEqual({"block", "test_puck", "soft_biped"}, set(cf.models()))
        self.assertTrue(cf.Model("block").has_friction)
        self.assertFalse(cf.Model("soft_biped").has_friction)

    def test_reference_cases(self):
        """As in test/friction: events to 1e-11 s, states to 1e-10, derivatives to 1e-8 of the largest."""
        directions = 0
        for name in NAMES:
            with self.subTest(name):
                data = case.reference("friction/" + name)
                values = dict(data["parameters"])
                for key, prefix in (("friction", "mu"), ("restitution", "gamma")):
                    for k, value in enumerate(data[key]):
                        values[prefix + str(k)] = -1.0 if isinstance(value, str) else value
                system = cf.Model({"puck": "test_puck"}.get(data["model"], data["model"]), **values)
                run = system.simulate(case.state(data["initial_state"]), data["horizon"],
                                      relative_tolerance=1e-12, absolute_tolerance=1e-12)
                self.assertTrue(run.status, run.status)
                self.assertEqual(data["mode_words"], run.mode_words)
                for wanted, event in zip(data["event_times"], run.events):
                    self.assertAlmostEqual(wanted, event.t, delta=1e-11)
                    self.assertNotEqual((), event.kinds)
                self.assertLess(largest(run.final_state - case.state(data["final_state"])), 1e-10)
                B = run.derivative(tolerance=1e-11)
                self.assertTrue(B.status, B.status)
                entries = data["directional_derivatives"]
                scale = max(largest(entry["derivative"]) for entry in entries)
                for entry in entries:
                    w = np.array(entry["direction"])
                    if largest(B.project(w) - w) > 1e-9:  # the run cannot start so
                        self.assertRaises(ValueError, B, w)
                        continue
                    self.assertLess(largest(B(w) - entry["derivative"]), 1e-8 * scale)
                    directions += 1
                self.assertEqual((len(run.events), system.dof), (len(run.arcs) - 1, len(run.final_state) // 2))
        self.assertGreaterEqual(directions, 40)

    def test_slip_is_a_kind_of_event(self):
        data = case.reference("friction/incline_stop")
        block = cf.Model("block", mu0=0.6, incline=0.3)
        run = block.simulate(case.state(data["initial_state"]), data["horizon"])
        self.assertEqual([("slip",)], [event.kinds for event in run.events])
        self.assertEqual(("+", "s"), (run.events[0].word_before, run.events[0].word_after))
        force = run.force([0.1, 1.0])   # λ_n, λ_t [n+l+r]
        self.assertEqual((2, 2), force.shape)
        self.assertAlmostEqual(-0.6 * force[0, 0], force[0, 1], places=12)
        self.assertLess(abs(force[1, 1]), 0.6 * force[1, 0])


if __name__ == "__main__":
    case.main()
