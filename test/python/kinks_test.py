#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Formulas of Python models where functions have a kink, a jump or a hole: the derivative, or a refusal; beside differences."""
import itertools
import math
import unittest
import warnings

import numpy as np

import contact_flow as cf
import case
from contact_flow import jet
from contact_flow.python_model import Terms
from contact_flow.ties import Kink, _have_a_side, settled

#: force(model, q, v), q, v
SMOOTH = {
    "v |v|": (lambda m, q, v: -v * abs(v), (0, 0), (0, 0)),
    "v norm(v)": (lambda m, q, v: -v * np.linalg.norm(v), (0, 0), (0, 0)),
    "v norm(v) in motion": (lambda m, q, v: -v * np.linalg.norm(v), (0, 0), (0.3, -0.4)),
    "hypot²": (lambda m, q, v: [np.hypot(v[0], v[1]) ** 2, 0.0], (0, 0), (0, 0)),
    "max(q, 0)²": (lambda m, q, v: np.maximum(q, 0) ** 2, (0, 0), (0, 0)),
    "max + min": (lambda m, q, v: [max(q[0], 0.0) + min(q[0], 0.0), 0.0], (0, 0), (0, 0)),
    "max(q, q)": (lambda m, q, v: np.maximum(q, q), (0, 0), (0, 0)),
    "where of one slope": (lambda m, q, v: np.where(q > 0, q + q**2, q), (0, 0), (0, 0)),
    "v² sign(v)": (lambda m, q, v: v**2 * np.sign(v), (0, 0), (0, 0)),
    "sign": (lambda m, q, v: np.sign(v), (0, 0), (0.1, -0.1)),
    "clip": (lambda m, q, v: np.clip(v, -1, 1), (0, 0), (0.5, -1.5)),
    "sinc": (lambda m, q, v: [np.sinc(q[0]), np.sinc(q[1])], (0, 0.7), (0, 0)),
    "sin(arctan2)": (lambda m, q, v: [np.sin(np.arctan2(q[0], q[1])), 0.0], (0, -1), (0, 0)),
    "powers": (lambda m, q, v: [q[0] ** 0 + q[0] ** 1 + q[0] ** 2 + q[1] ** 3, q[0] ** 1.5 * 0 + 2], (0, 0), (0, 0)),
    "0 to a power": (lambda m, q, v: [0 ** q[0], 2 ** q[1]], (0.5, 0), (0, 0)),
    "power of 0": (lambda m, q, v: [q[0] ** v[0], 0.0], (0, 0), (4, 0)),
    "sum of the sorted": (lambda m, q, v: [np.sum(np.sort([*q, *v])), 0.0], (0, 0), (0, 0)),
    "sorted": (lambda m, q, v: [np.sum(np.sort(q)), np.median(q)], (0.3, -0.2), (0, 0)),
    "picked by a comparison": (lambda m, q, v: (q > 0) * q, (0.3, -0.2), (0, 0)),
    "not q": (lambda m, q, v: [q[0] if q[0] else 0.0, 0.0], (0, 0), (0, 0))}

REFUSED = {
    "|v|": (lambda m, q, v: -abs(v), (0, 0), (0, 0)),
    "|q| + |−q|": (lambda m, q, v: abs(q) + abs(-q), (0, 0), (0, 0)),
    "norm": (lambda m, q, v: [np.linalg.norm(v), 0.0], (0, 0), (0, 0)),
    "norm of two": (lambda m, q, v: [np.linalg.norm(q, 1), np.linalg.norm(q, np.inf)], (0, 0), (0, 0)),
    "hypot": (lambda m, q, v: [np.hypot(v[0], v[1]), 0.0], (0, 0), (0, 0)),
    "root of a square": (lambda m, q, v: [(q[0] * q[0]) ** 0.5, 0.0], (0, 0), (0, 0)),
    "sqrt": (lambda m, q, v: [np.sqrt(q[0]), 0.0], (0, 0), (0, 0)),
    "sign": (lambda m, q, v: np.sign(v), (0, 0), (0, 0)),
    "max": (lambda m, q, v: np.maximum(q, v), (0.5, 0), (0.5, 1)),
    "clip": (lambda m, q, v: np.clip(v, -1, 1), (0, 0), (1, 0)),
    "a clip that is odd": (lambda m, q, v: [np.clip(q[0], -abs(q[1]), abs(q[1])), 0.0], (0, 0), (0, 0)),
    "where": (lambda m, q, v: np.where(q > 0, q, 2 * q), (0, 1), (0, 0)),
    "where of a jump": (lambda m, q, v: np.where(q == 0, 1.0, q), (0, 1), (0, 0)),
    "piecewise": (lambda m, q, v: np.piecewise(q, [q < 0, q >= 0], [lambda x: -x, lambda x: x]), (0, 1), (0, 0)),
    "sort": (lambda m, q, v: np.sort(q), (1, 1), (0, 0)),
    "a corner in one of 16 orthants": (lambda m, q, v: [max(0.0, min(-q[0], q[1], v[0], -v[1])), 0.0], (0, 0), (0, 0)),
    "a product of sides": (lambda m, q, v: [q[0] * (q[0] > 0) * (q[1] > 0) * (v[0] > 0), 0.0], (0, 0), (0, 0)),
    "|v| in small units": (lambda m, q, v: -1e-12 * abs(v), (0, 0), (0, 0)),
    "a sinc of one's own": (lambda m, q, v: [np.where(q[0] == 0, 1.0, np.sin(q[0]) / q[0])[()], 0.0], (0, 1), (0, 0)),
    "arctan2 nowhere": (lambda m, q, v: [np.arctan2(q[0], q[1]), 0.0], (0, 0), (0, 0)),
    "arctan2 at its cut": (lambda m, q, v: [np.arctan2(q[0], q[1]), 0.0], (0, -1), (0, 0)),
    "arcsin": (lambda m, q, v: [np.arcsin(q[0]), 0.0], (1, 0), (0, 0)),
    "a negative number to a power": (lambda m, q, v: [(-2) ** q[0], 0.0], (2, 0), (0, 0)),
    "0⁰": (lambda m, q, v: [0 ** q[0], 0.0], (0, 0), (0, 0))}


def system(force, parameters=None):
    def mass_matrix(self, q):
        return np.eye(2)

    fields = {"coordinates": ("x", "y"), "constant_mass": True, "parameters": parameters or {}, "mass_matrix": mass_matrix,
              "force": lambda self, q, v, u: force(self, q, v)}
    return type("Formula", (cf.Formulas,), fields)


def slopes(force, q, v):
    """∂f/∂(q, v) [2×4] of the model."""
    by_q, by_v, *_ = Terms(system(force), {}).differentiate_dynamics(
        np.array(q, float), np.array(v, float), np.zeros(0), 0, np.zeros(2), np.zeros(0))
    return -np.hstack([by_q, by_v])


class Formulas(unittest.TestCase):
    def setUp(self):
        warnings.simplefilter("ignore", RuntimeWarning)

    def test_derivatives_beside_quotients(self):
        """One-sided quotients to each side: error h·D²f/2, at most 1e-5 here."""
        h = 1e-6
        for name, (force, q, v) in SMOOTH.items():
            with self.subTest(name):
                found, z = slopes(force, q, v), np.array(q + v, float)
                for k in range(4):
                    for side in (h, -h):
                        if name == "powers" and k == 0 and side < 0:
                            continue   # q^1.5 is nowhere there
                        e = side * np.eye(4)[k]
                        f = [np.array(force(None, x[:2], x[2:]), float) for x in (z + e, z)]
                        np.testing.assert_allclose((f[0] - f[1]) / side, found[:, k], atol=2e-5)

    def test_what_has_no_derivative_is_refused(self):
        for name, (force, q, v) in REFUSED.items():
            with self.subTest(name):
                with self.assertRaisesRegex(Kink, r"^Formula\.force\(q, v, u\) "):
                    slopes(force, q, v)

    def test_messages(self):
        for name, message in (("|v|", "decides here on .x. of 0, and beside this point its derivative is not everywhere"),
                              ("sign", "beside this point it jumps: there is no derivative"),
                              ("sqrt", "has no finite derivative here")):
            with self.assertRaisesRegex(Kink, message):
                slopes(*REFUSED[name])

    def test_what_duals_do_not_pass_through(self):
        for force in (lambda m, q, v: np.floor(q), lambda m, q, v: q % 1, lambda m, q, v: np.rint(q),
                      lambda m, q, v: [np.linalg.norm(q, 3), 0.0], lambda m, q, v: np.heaviside(q, 0)):
            with self.assertRaisesRegex(TypeError, "force.*duals do not pass through it"):
                slopes(force, (0.1, 0.2), (0, 0))
        for force in (lambda m, q, v: np.sin(np.array([q[0], 1.0])), lambda m, q, v: [np.hypot(2.0, q[0]), 0.0]):
            with self.assertRaisesRegex(TypeError, "numbers beside duals: add 0 . q.0. to them"):
                slopes(force, (0.1, 0.2), (0, 0))

    def test_every_side_is_seen(self):
        """max(0, min of n numbers) at 0 has a slope in one of 2ⁿ orthants alone, whichever; v |v| of many none."""
        def flat(self, q, v, u):
            return -v * abs(v)

        for n in range(1, 7):
            for signs in itertools.product((-1.0, 1.0), repeat=n):
                corner = jet.variables(np.zeros(n), 0, n)
                with self.assertRaises(Kink):
                    settled(lambda: jet.coefficients([max(0.0, min(corner * signs))], (1, 1 + n)), "f")
        many = type("Many", (cf.Formulas,), {
            "coordinates": tuple("x%d" % k for k in range(12)), "mass_matrix": lambda self, q: np.eye(12), "force": flat})
        zero = np.zeros(12)
        by_q, by_v, *_ = Terms(many, {}).differentiate_dynamics(zero, zero, np.zeros(0), 0, zero, np.zeros(0))
        self.assertEqual(0, np.max(np.abs([by_q, by_v])))

    def test_which_sides_there_are(self):
        """Signs of linear forms that some w has, beside 2000 drawn w."""
        rng = np.random.default_rng(1)
        for _ in range(300):
            rows = rng.integers(-2, 3, size=(rng.integers(1, 6), rng.integers(1, 4))).astype(float)
            rows = rows[np.any(rows != 0, axis=1)]
            if len(rows):
                rows /= np.linalg.norm(rows, axis=1)[:, None]
                drawn = rng.normal(size=(2000, rows.shape[1])) @ rows.T
                self.assertEqual(bool(np.any(np.all(drawn > 0, axis=1))), _have_a_side(list(rows)), rows)

    def test_parameters(self):
        """Kinks in what varies count, roots of what is constant do not."""
        def by(force, parameter):
            terms = Terms(system(force, {"a": 0.0, "b": 1.0}), {})
            x = np.array([1.0, 2.0])
            return terms.differentiate_dynamics_by_parameters(x, x, np.zeros(0), 0, x, np.zeros(0), [parameter])[0]

        np.testing.assert_array_equal(by(lambda m, q, v: np.sqrt(m.a) + m.b * q, 1), [[-1], [-2]])
        np.testing.assert_array_equal(by(lambda m, q, v: m.a * abs(m.a) + q, 0), [[0], [0]])
        for force in (lambda m, q, v: np.sqrt(m.a) + q, lambda m, q, v: np.maximum(m.a, 0) * q):
            with self.assertRaises(Kink):
                by(force, 0)


class Places(unittest.TestCase):
    def test_sinc(self):
        """Up to the third slope, beside the series 1 − y²/6 + y⁴/120 − …, y = π x."""
        for x in (0.0, 1e-9, -0.2, 0.3, 0.3184, 1.7):
            c = np.sinc(jet.motion([x], [1.0], [0.0], 2, True)[0]).c
            terms = [(-1.0) ** k * math.pi ** (2 * k) / math.factorial(2 * k + 1) for k in range(25)]
            for order, value in enumerate((c[0, 0], c[1, 0], 2 * c[2, 0], 2 * c[2, 1])):
                series = sum(a * math.perm(2 * k, order) * x ** (2 * k - order)
                             for k, a in enumerate(terms) if 2 * k >= order)
                self.assertAlmostEqual(series, value, delta=1e-12 * math.pi ** order)

    def test_a_mass_that_bends_at_zero(self):
        """M = 2 + sinc(q): M″(0) = −π²/3 enters ∂r₁/∂q = … − ½ M″ v² + … of one coordinate."""
        class Bending(cf.Formulas):
            coordinates = ("x",)

            def mass_matrix(self, q):
                return [[2 + np.sinc(q[0])]]

            def force(self, q, v, u):
                return [0.0]

        terms, one = Terms(Bending, {}), np.array([1.0])
        by_q = terms.differentiate_dynamics(np.zeros(1), one, np.zeros(0), 0, np.zeros(1), np.zeros(0))[0]
        self.assertAlmostEqual(-math.pi**2 / 6, by_q[0, 0], places=12)   # M v̇ + ½ M′ v²

    def test_a_gap_may_have_a_kink_where_it_is_open(self):
        class Corridor(cf.Formulas):
            coordinates = ("x",)
            constraints = ("walls",)
            parameters = {"restitution": 1.0}

            def mass_matrix(self, q):
                return [[1.0]]

            def force(self, q, v, u):
                return [0.0]

            def gaps(self, q):
                return [1 - abs(q[0])]

        run = cf.PythonModel(Corridor).simulate([0.0, 1.0], 1.5)
        self.assertTrue(run.status, run.status)
        self.assertAlmostEqual(0.5, run.final_state[0], places=9)
        np.testing.assert_allclose(run.derivative().jacobian(), [[-1, -1.5], [0, -1]], atol=1e-9)
        touching = type("Touching", (Corridor,), {"gaps": lambda self, q: [abs(q[0])]})
        with self.assertRaisesRegex(ArithmeticError, r"Touching.gaps\(q\) decides here on .x. of 0"):
            cf.PythonModel(touching).simulate([0.0, 0.0], 1.0)

    def test_a_run_through_a_kink_has_the_derivative_or_none(self):
        """A drag −|v| at rest: a run, no derivative; −v |v| at rest: δx = δx₀ + T δv₀."""
        kinked = cf.PythonModel(system(lambda m, q, v: -abs(v))).simulate([0, 0, 0, 0], 1.0)
        self.assertTrue(kinked.status)
        with self.assertRaisesRegex(ArithmeticError, r"Formula.force\(q, v, u\) decides here on .x. of 0"):
            kinked.derivative()("+x")
        smooth = cf.PythonModel(system(lambda m, q, v: -v * abs(v))).simulate([0, 0, 0, 0], 1.0)
        np.testing.assert_allclose(smooth.derivative().jacobian()[0], [1, 0, 1, 0], atol=1e-9)


if __name__ == "__main__":
    case.main()
