#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Models of one's own in C++, from a library that Python loads; they stick and slip. Boxes that do."""
import ctypes
import json
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


def body(base, mass, inertia, points, friction, efforts=None, **fields):
    """A rigid body over a floor that its points touch."""
    urdf = """<robot name="body"><link name="base_link"><inertial><mass value="%r"/>
      <inertia ixx="%r" iyy="%r" izz="%r" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>""" % (mass, *inertia)
    feet = {"foot_%d" % k: {"kind": "plane", "link": "base_link", "point": point, "friction": friction, **fields}
            for k, point in enumerate(points)}
    return cf.Robot.from_strings(urdf, json.dumps({"base": base, "constraints": feet, "efforts": efforts or {}}))


class Boxes(unittest.TestCase):
    def test_tangents_do_not_follow_rounding(self):
        """A box slides on its face to a stop: of v0, x = v0^2 / (2 mu g). Its Jacobian is rounding."""
        for speed in (-0.1, -1.0, 1.0):
            box = body("planar", 1.0, (0.25 / 12, 0.34 / 12, 0.41 / 12), [[-0.25, 0, -0.15], [0.25, 0, -0.15]], 0.3)
            run = box.simulate({"base_z": 0.15, "d/dt base_x": speed}, 0.35,
                               relative_tolerance=1e-12, absolute_tolerance=1e-12)
            self.assertTrue(run.status, run.status)
            B = run.derivative(max_seconds=30)
            self.assertTrue(B.status, B.status)
            w = B.direction("d/dt base_x")
            self.assertAlmostEqual(abs(speed) / (0.3 * 9.81), B(w)[0], places=11)
            self.assertLess(largest(B.error(w)), 1e-11)

    def test_a_face_begins_to_slide_and_turn(self):
        """Under a push beside its centre that grows: its corners stick as long as any share of its weight lets them."""
        corners = [[x, y, -0.15] for x in (-0.25, 0.25) for y in (-0.2, 0.2)]
        for place, friction in (([0.18, -0.075, 0], 0.5), ([-0.0857, -0.178, 0], 0.2), ([0.1, 0, 0], 0.3)):
            rate = 40 * friction
            push = {"kind": "timed_force", "link": "base_link", "point": place, "force": [1, 0.2, 0],
                    "reference": {"kind": "cubic", "times": [0, 1, 2], "values": [0, rate, 2 * rate]}}
            box = body("floating", 2.0, (0.25 / 6, 0.34 / 6, 0.41 / 6), corners, friction, {"push": push})
            run = box.simulate({"base_z": 0.15}, 0.7)
            self.assertTrue(run.status, run.status)
            self.assertEqual(["ssss", "llll"], run.mode_words)
            self.assertGreater(run.final_state[8], 0.01)      # slides
            self.assertGreater(abs(run.final_state[13]), 1e-3)  # and turns
            self.assertEqual("indeterminate forces", run.derivative().status.outcome)

    def test_impacts_leave_the_clock_of_a_conveyor(self):
        """What lands and slips on it in space, by all numbers of its start, that of its clock's rate as well."""
        ball = body("floating", 2.814, (0.0101, 0.0126, 0.0152), [[0.17, -0.197, -0.011], [-0.043, -0.187, 0.023]],
                    0.5, motion={"direction": [1, 0, 0], "velocity": 0.3})
        q = np.array([0.824207, 0.034111, -0.502776, 0.258334])
        run = ball.simulate(np.r_[0, 0, 0.123942, q / np.linalg.norm(q), 0,
                                  0.502113, -0.285154, -0.519397, -0.672113, -2.682382, -1.7192, 1], 0.16,
                            relative_tolerance=1e-12, absolute_tolerance=1e-12)
        self.assertEqual(["oo", "ol"], run.mode_words)
        B = run.derivative()
        self.assertTrue(B.status, B.status)
        for name in ("+d/dt clock", "+base_z", "+clock"):
            quotients = B.compare(name, alphas=[1e-6])
            self.assertLess(quotients.samples[0].error, 1e-3, name)
            self.assertLess(largest(B.error(B.direction(name))), 1e-6, name)


if __name__ == "__main__":
    case.main()
