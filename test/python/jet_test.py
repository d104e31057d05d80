#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Jets against complex steps, and against each other: first, second and third derivatives."""
import math
import unittest

import numpy as np

import case
from contact_flow import jet

#: f(x), and an x inside its domain
FUNCTIONS = {
    "sin": 0.7, "cos": 0.7, "tan": 0.7, "exp": 0.3, "log": 1.7, "sqrt": 1.7, "sinh": 0.4, "cosh": 0.4,
    "tanh": 0.4, "arcsin": 0.3, "arccos": 0.3, "arctan": 1.3, "exp2": 0.3, "expm1": 0.3, "log1p": 0.7, "log2": 1.7,
    "log10": 1.7, "arcsinh": 0.4, "arccosh": 1.7, "arctanh": 0.3}


def complex_step(f, x):
    """f′(x), right to rounding."""
    return f(x + 1e-30j).imag / 1e-30


class Jets(unittest.TestCase):
    def test_functions(self):
        """Through f(x + s + s²/2) with a derivative along x: slopes up to the third."""
        for name, x in FUNCTIONS.items():
            with self.subTest(name):
                f = getattr(np, name)
                at = jet.motion([x], [1.0], [0.0], 2, True)[0]
                c = f(at).c
                self.assertAlmostEqual(f(x), c[0, 0], places=15)
                self.assertAlmostEqual(complex_step(f, x), c[1, 0], places=14)
                # c[1, 1] = f″; c[2, 0] = f″/2; c[2, 1] = f‴/2
                self.assertAlmostEqual(c[1, 1], 2 * c[2, 0], places=13)
                h = 1e-4   # error of the difference h²·f⁽⁴⁾ ~ 1e-7, of the slope's rounding 1e-16/h
                second = (complex_step(f, x + h) - complex_step(f, x - h)) / (2 * h)
                self.assertAlmostEqual(second, c[1, 1], delta=1e-6)
                third = (complex_step(f, x + h) - 2 * complex_step(f, x) + complex_step(f, x - h)) / h**2
                self.assertAlmostEqual(third, 2 * c[2, 1], delta=1e-5)

    def test_functions_without_complex_numbers(self):
        x = jet.motion([-1.7], [1.0], [0.0], 2, True)[0]
        np.testing.assert_allclose(np.cbrt(x).c, -((-x) ** (1 / 3)).c, rtol=1e-14)
        np.testing.assert_array_equal(np.fabs(x).c, (-x).c)
        for way, factor in ((np.deg2rad, math.pi / 180), (np.radians, math.pi / 180), (np.degrees, 180 / math.pi),
                            (np.rad2deg, 180 / math.pi)):
            np.testing.assert_allclose(way(x).c, factor * x.c, rtol=1e-15)
        q = jet.variables([1.0, 4.0], 0, 2)
        np.testing.assert_allclose(np.std(q).c, [[1.5, -0.5, 0.5]], rtol=1e-15)

    def test_slopes_near_the_end_of_a_domain(self):
        """arcsin′(1 − h) = 1/√(2h − h²): no digits are lost in 1 − x²."""
        h = 2.0 ** -40
        x = jet.variables([1 - h], 0, 1)[0]
        self.assertAlmostEqual(1, np.arcsin(x).c[0, 1] * math.sqrt(2 * h - h * h), places=14)

    def test_mixed_derivatives(self):
        """f = exp(x y) + x / y³ + arctan2(x, y) + hypot(x, y) − 2ˣ: all first and second ones."""
        def f(x, y):
            return np.exp(x * y) + x / y**3 + np.arctan2(x, y) + np.hypot(x, y) - 2**x

        x, y = 0.7, 1.3
        c = f(*jet.variables([x, y], 0, 2, 2, True)).c
        r = math.hypot(x, y)
        e, l2 = math.exp(x * y), math.log(2)
        self.assertAlmostEqual(float(f(x, y)), c[0, 0], places=14)
        slope = [y * e + y**-3 + y / r**2 + x / r - l2 * 2**x, x * e - 3 * x * y**-4 - x / r**2 + y / r]
        np.testing.assert_allclose(c[0, 1:], slope, rtol=1e-14)
        np.testing.assert_allclose(c[1:, 0], slope, rtol=1e-14)
        xx = y * y * e - 2 * x * y / r**4 + y * y / r**3 - l2**2 * 2**x
        yy = x * x * e + 12 * x * y**-5 + 2 * x * y / r**4 + x * x / r**3
        xy = e * (1 + x * y) - 3 * y**-4 + (x * x - y * y) / r**4 - x * y / r**3
        np.testing.assert_allclose(c[1:, 1:], [[xx, xy], [xy, yy]], rtol=1e-13)

    def test_arctan2_in_all_quadrants(self):
        for angle in np.linspace(-3.1, 3.1, 21):
            y, x = jet.variables([math.sin(angle), math.cos(angle)], 0, 2)
            turned = np.arctan2(y, x)
            self.assertAlmostEqual(angle, turned.value, places=14)
            np.testing.assert_allclose(turned.c[0, 1:], [math.cos(angle), -math.sin(angle)], atol=1e-14)

    def test_powers_at_zero(self):
        zero = jet.variables([0.0], 0, 1, 1, True)[0]
        np.testing.assert_array_equal((zero**2).c, [[0, 0], [0, 2]])
        np.testing.assert_array_equal((zero**3).c, np.zeros((2, 2)))
        np.testing.assert_array_equal((1 + zero**0).c, [[2, 0], [0, 0]])

    def test_arrays(self):
        q = jet.variables([1.0, 2.0, 3.0], 0, 3)
        M = np.arange(9.0).reshape(3, 3)
        c = jet.coefficients(M @ q, (1, 4))
        np.testing.assert_array_equal(c[:, 0, 1:], M)
        np.testing.assert_allclose(jet.coefficients(np.linalg.norm(q), (1, 4))[0, 1:],
                                   np.array([1, 2, 3]) / math.sqrt(14), rtol=1e-15)
        self.assertAlmostEqual(3, jet.coefficients([np.max(q)], (1, 4))[0, 0, 0])
        self.assertTrue(q[0] < q[1] and q[0] <= 1 and 2 >= q[1] and q[2] > 2.5 and q[0] != 2 and q[0] == 1)
        self.assertEqual(-1, (-abs(q[0] - 2)).value)
        np.testing.assert_array_equal(q[0] > np.array([0.5, 2.0]), [True, False])

    def test_no_float_is_made_of_a_jet(self):
        q = jet.variables([1.0], 0, 1)
        for drop in (lambda: math.sin(q[0]), lambda: float(q[0]), lambda: np.zeros(1).__setitem__(0, q[0]),
                     lambda: np.asarray(q, dtype=float)):
            with self.assertRaises(TypeError):
                drop()


if __name__ == "__main__":
    case.main()
