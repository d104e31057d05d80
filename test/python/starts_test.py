#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Directions at starts in contact: those that leave it are refused, by every way to ask."""
import json
import math
import pathlib
import tempfile
import unittest

import numpy as np

import contact_flow as cf
import case
from case import largest
from command import command
from report_test import data_of


class StartsInContact(unittest.TestCase):
    def setUp(self):
        self.puck = cf.Model("puck")
        self.B = self.puck.simulate().derivative()

    def test_a_puck_does_not_start_in_the_floor(self):
        B = self.B
        self.assertEqual((), cf.Model("puck").simulate({"z": 1}, 0.1).modes[0])
        for w in ("-z", "+z", "+d/dt z", {"x": 1, "z": 1e-3}, np.eye(6)[2]):
            for ask in (B, B.error, B.radius, B.perturbed_modes, B.clusters, B.compare):
                with self.assertRaisesRegex(ValueError, r"w leaves the contact mode \{floor\} of the start"):
                    ask(w)
        with self.assertRaisesRegex(ValueError, r"w\[1\] leaves the contact mode"):
            B(np.eye(6)[[0, 2]])
        self.assertEqual(1, B("+x")[0])
        np.testing.assert_array_equal(np.zeros(6), B.project("-z"))
        np.testing.assert_array_equal(np.zeros(6), B(B.project("-z")))

    def test_a_biped_that_stands(self):
        """Quotients along what was given numbers before are off by 3; along projections they fall like α."""
        biped = cf.Model("soft_biped")
        run = biped.simulate(biped.simulate().events[0].x_plus, 0.3)
        B = run.derivative()
        with self.assertRaisesRegex(ValueError, "left_foot, right_foot"):
            B.compare("+left_foot_z", [1e-3])
        w = B.project({"left_foot_z": 1, "body_pitch": 1})
        self.assertGreater(B.compare(w, [1e-3, 1e-4, 1e-5]).slope, 0.9)

    def test_parameters_that_move_a_contact(self):
        rod = cf.Model("sliding_rod")
        B = rod.simulate(duration=0.05).derivative(by=["half_length"])
        with self.assertRaisesRegex(ValueError, "leaves the contact mode"):
            B("-half_length")
        w = B.project("-half_length")
        self.assertEqual(-1, w[-1])
        self.assertGreater(largest(w[:-1]), 0)
        self.assertGreater(B.compare(w, [1e-3, 1e-4, 1e-5]).slope, 0.9)

    @case.needs_linear_programs
    def test_matrices_are_those_of_projections(self):
        B = cf.Model("sliding_rod").simulate(duration=0.05).derivative()
        P = np.array([B.project(e) for e in np.eye(6)]).T
        J, pieces = B.jacobian(), B.pieces()
        np.testing.assert_allclose(J, J @ P, atol=1e-9 * largest(J))
        for w in np.random.default_rng(1).normal(size=(5, 6)):
            np.testing.assert_allclose(J @ w, B(P @ w), atol=1e-9 * largest(J))
            np.testing.assert_allclose(pieces(w), B(P @ w), atol=1e-9 * largest(J))
        covariance = pieces.covariance(np.eye(6)).covariance
        np.testing.assert_allclose(covariance, J @ J.T, atol=1e-9 * largest(J) ** 2)
        puck = self.B.pieces().covariance(np.diag([0, 0, 1.0, 0, 0, 0]))
        self.assertEqual(0, largest(puck.covariance), "it cannot be moved through the floor")

    def test_a_slip_that_begins(self):
        block = cf.Model("block_on_incline", friction=0.1)
        B = block.simulate({"d/dt x": 0}, 0.1).derivative()
        along, against = B("+d/dt x"), B("-d/dt x")
        self.assertAlmostEqual(1, along[3], delta=1e-9)
        self.assertTrue(-1 < against[3] < 0, "it is turned back, and has lost time")
        self.assertEqual(2, len(B.pieces()))

    def test_the_command_and_the_report(self):
        code, out, err = command("derive", "puck", "--json")
        self.assertEqual(0, code, err)
        answers = {entry["name"]: entry for entry in json.loads(out)["directions"]}
        self.assertIn("leaves the contact mode", answers["-z"]["refused"])
        self.assertIn("value", answers["+x"])
        code, out, err = command("compare", "puck", "-w", "-z")
        self.assertEqual(2, code)
        self.assertIn("leaves the contact mode", err)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "run.html"
            self.puck.simulate().report(path)
            entry = data_of(path.read_text(encoding="utf-8"))["derivative"]["directions"][2]
            self.assertIn("leaves the contact mode", entry["down"]["refused"])


class Radii(unittest.TestCase):
    def test_forces_that_are_least_behind_a_touchdown(self):
        """Against the sequence of modes on both sides of the radius; to first order it is 10 % off here."""
        biped = cf.Model("soft_biped")
        run = biped.simulate()
        w = np.eye(14)[6]
        radius = run.derivative().radius(w)
        self.assertEqual(("force", "right_foot"), (radius.limit, radius.constraint))
        self.assertAlmostEqual(1 / 4.836, radius.radius, delta=1e-4)   # 4.836 is of four digits
        inside, outside = ([biped.simulate(biped.perturb(run.x0, k * radius.radius * w)).mode_words]
                           for k in (0.8, 1.2))
        self.assertEqual([["oo", "lo", "ll"]], inside)
        self.assertNotEqual(inside, outside)

    def test_of_a_slip_that_stops(self):
        """After v0/k, k = g (mu cos phi - sin phi), v0 = 1: pushed harder, the block slides to the end."""
        B = cf.Model("block_on_incline", incline=0.3, friction=0.5).simulate(duration=1.5).derivative()
        radius = B.radius("+d/dt x")
        self.assertEqual("horizon", radius.limit)
        k = 9.81 * (0.5 * math.cos(0.3) - math.sin(0.3))
        self.assertAlmostEqual(1.5 * k - 1, radius.radius, places=6)
        self.assertEqual("none", B.radius("+x").limit)
        _, out, _ = command("derive", "block_on_incline", "-w", "+x", "--json")
        entry, = json.loads(out)["directions"]
        self.assertEqual((None, "none"), (entry["radius"], entry["limit"]))   # unlimited


if __name__ == "__main__":
    case.main()
