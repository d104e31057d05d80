#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Models in Python whose formulas are differentiated by differences, beside duals; and where neither tells."""
import pickle
import unittest

import numpy as np

import contact_flow as cf
import case
from case import largest
from contact_flow.python_model import Terms
from python_models import DoublePendulum, Pendulum, Rod, SoftBiped, Wheel


def by_differences(formulas, **fields):
    return type(formulas.__name__, (formulas,), dict(fields, differentiation="differences"))


class Kinked(cf.Formulas):
    """A spring that is slack below the ground, and a force out of a table."""

    coordinates = ("z",)
    parameters = {"stiffness": 3.0}
    differentiation = "differences"
    constant_mass = True
    table = np.linspace(-2, 2, 5)

    def mass_matrix(self, q):
        return [[1.0]]

    def force(self, q, v, u):
        return [-self.stiffness * np.interp(q[0], self.table, np.abs(self.table))]

    def nominal(self):
        return [1.5, 0.0], [], 0.2


class EveryTerm(unittest.TestCase):
    def test_beside_duals(self):
        """First derivatives to 1e-11, second and third to 1e-7, of parameters too, to 1e-6."""
        rng = np.random.default_rng(0)
        for formulas in (SoftBiped, Wheel, DoublePendulum, Rod, Pendulum):
            one, two = Terms(formulas, {}), Terms(by_differences(formulas), {})
            d, all_of_them = one.d, list(range(len(one.parameter_list)))
            for _ in range(3):
                x = one.nominal_x + 0.05 * rng.normal(size=2 * d)
                q, v, u = x[:d], x[d:] + rng.normal(size=d), one.nominal_u
                a, force = rng.normal(size=d), rng.normal(size=one.rows)
                for name, given, accuracy in (
                        ("dynamics", (q, v, u, 0), 1e-11), ("constraint_terms", (q, v), 1e-9),
                        ("differentiate_dynamics", (q, v, u, 0, a, force), 1e-7),
                        ("differentiate_impact", (q, a, force, v), 1e-7),
                        ("differentiate_dynamics_by_parameters", (q, v, u, 0, a, force, all_of_them), 1e-6),
                        ("differentiate_impact_by_parameters", (q, a, force, v, all_of_them), 1e-7)):
                    for exact, found in zip(getattr(one, name)(*given), getattr(two, name)(*given)):
                        scale = max(1.0, largest(exact))
                        self.assertLessEqual(largest(np.asarray(exact) - found), accuracy * scale,
                                             (formulas.__name__, name))


class Runs(unittest.TestCase):
    def test_the_same_run_and_derivative(self):
        swing = cf.Model("double_pendulum").nominal
        for formulas, x, duration, by in (
                (DoublePendulum, swing.x + [0.02, -0.01, 0, 0.01], swing.duration, ["inputs", "parameters"]),
                (Wheel, None, None, ["inputs", "parameters"]),
                (Pendulum, [0.9, 0.0], 1.5, ["state"])):
            runs = [cf.PythonModel(kind).simulate(x, duration, relative_tolerance=1e-10, absolute_tolerance=1e-10)
                    for kind in (formulas, by_differences(formulas))]
            self.assertGreater(len(runs[0].events), 0)
            self.assertEqual(runs[0].modes, runs[1].modes)
            self.assertLess(largest(runs[0].final_state - runs[1].final_state), 1e-10)
            B, C = (run.derivative(by=by) for run in runs)
            self.assertTrue(C.status, C.status)
            for w in np.eye(B.shape[1]):
                self.assertLess(largest(B(w) - C(w)), 1e-8 * max(1.0, largest(B(w))))

    def test_which_way_is_said(self):
        two = cf.PythonModel(by_differences(Pendulum))
        self.assertEqual(("duals", "differences"), (cf.PythonModel(Pendulum).differentiation, two.differentiation))
        self.assertIn("by differences", repr(two))
        self.assertIn("by duals", repr(cf.PythonModel(Pendulum)))
        model = cf.PythonModel(Kinked, stiffness=2.0)
        again = pickle.loads(pickle.dumps(model))
        self.assertEqual(("differences", 2.0), (again.differentiation, again.parameters["stiffness"]))

    def test_what_duals_do_not_know(self):
        """An interpolated table: refused with duals, and right by differences between its knots."""
        duals = cf.PythonModel(type("Duals", (Kinked,), {"differentiation": "duals"}))
        with self.assertRaisesRegex(TypeError, "force.*duals do not pass through it, differentiation = 'differences'"):
            duals.simulate().derivative()("+z")
        B = cf.PythonModel(Kinked).simulate().derivative()   # z̈ = −3 z from 1 to 2
        w, T = np.sqrt(3.0), 0.2
        wanted = [[np.cos(w * T), np.sin(w * T) / w], [-w * np.sin(w * T), np.cos(w * T)]]
        np.testing.assert_allclose(B.jacobian(), wanted, atol=1e-8)

    def test_kinks_are_refused(self):
        with self.assertRaisesRegex(ArithmeticError, r"force\(q, v, u\) changes too fast for differences of 0.006"):
            cf.PythonModel(Kinked).simulate({"z": 0.0}, 0.01).derivative()("+z")

    def test_kinks_off_the_axes_and_in_small_units(self):
        def slopes(force):
            kind = type("Formula", (cf.Formulas,), {
                "coordinates": ("x", "y"), "constant_mass": True, "differentiation": "differences",
                "mass_matrix": lambda self, q: np.eye(2), "force": lambda self, q, v, u: force(q, v)})
            two, none = np.zeros(2), np.zeros(0)
            return Terms(kind, {}).differentiate_dynamics(two, two, none, 0, two, none)

        for force in (lambda q, v: [max(0.0, min(q)), 0.0], lambda q, v: [min(0.0, max(q[0], v[0])), 0.0],
                      lambda q, v: -1e-9 * abs(v), lambda q, v: [-1e4 * q[0], 0.1 * abs(q[1])]):
            with self.assertRaisesRegex(ArithmeticError, "changes too fast for differences of 0.006, or has a kink"):
                slopes(force)
        by_q, by_v, *_ = slopes(lambda q, v: [1e3 - 1e-9 * np.sin(q[0]), q[0] * q[1] - v[1]])
        np.testing.assert_allclose(by_q, [[1e-9, 0], [0, 0]], atol=1e-10)   # rounding 1e3·2e-16/0.006 = 4e-11
        np.testing.assert_allclose(by_v, [[0, 0], [0, 1]], atol=1e-10)

    def test_other_ways_are_refused(self):
        for fields, what in (({"differentiation": "symbols"}, "differentiation is 'symbols', expected 'duals' or"),
                             ({"difference_step": 0.0}, "difference_step is 0.0"),
                             ({"difference_step": float("nan")}, "difference_step is nan")):
            with self.assertRaisesRegex(ValueError, what):
                cf.PythonModel(type("Bad", (Pendulum,), fields))


if __name__ == "__main__":
    case.main()
