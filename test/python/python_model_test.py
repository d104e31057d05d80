#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Models in Python against the same in C++: runs to 1e-10, derivatives to 1e-8; and what is refused."""
import functools
import math
import pickle
import unittest

import numpy as np

import contact_flow as cf
import case
from case import largest
from python_models import DoublePendulum, Pendulum, Rod, SoftBiped, Wheel


class SameAsInCpp(unittest.TestCase):
    def check(self, formulas, name, x=None, u=None, duration=None):
        python = cf.PythonModel(formulas)
        cpp = cf.Model(name, **python.parameters)
        x = cpp.nominal.x if x is None else x
        u = cpp.nominal.u if u is None else u
        duration = cpp.nominal.duration if duration is None else duration
        runs = [s.simulate(x, duration, u, relative_tolerance=1e-12, absolute_tolerance=1e-12)
                for s in (python, cpp)]
        self.assertTrue(runs[0].status, runs[0].status)
        self.assertGreater(len(runs[0].events), 0)
        self.assertEqual(runs[0].modes, runs[1].modes)
        for event, other in zip(runs[0].events, runs[1].events):
            self.assertAlmostEqual(event.t, other.t, delta=1e-10)
        t = np.linspace(0, duration, 50)
        self.assertLessEqual(largest(runs[0].x(t) - runs[1].x(t)), 1e-10)
        B, C = (run.derivative(by=["inputs", "parameters"], tolerance=1e-12) for run in runs)
        self.assertTrue(B.status, B.status)
        scale = max(1.0, max(largest(C(w)) for w in np.eye(C.shape[1])))
        for w in np.concatenate([np.eye(B.shape[1]), -np.eye(B.shape[1])]):
            self.assertLessEqual(largest(B(w) - C(w)), 1e-8 * scale, w)
        return B, C

    def test_soft_biped(self):
        B, C = self.check(SoftBiped, "soft_biped")
        self.assertEqual(2, len(B.pieces()))
        for piece, other in zip(B.pieces(), C.pieces()):
            self.assertLessEqual(largest(piece.matrix - other.matrix), 1e-8)
        biped = cf.Model("soft_biped")
        self.check(SoftBiped, "soft_biped", biped.state(body_pitch=0.1))

    def test_double_pendulum(self):
        """M depends on q; elastic stops; inputs."""
        self.check(DoublePendulum, "double_pendulum")
        pendulum = cf.Model("double_pendulum")
        self.check(DoublePendulum, "double_pendulum", pendulum.nominal.x + [0.02, -0.01, 0, 0.01],
                   [0.01, -0.02])

    def test_every_term(self):
        """Where M and gaps bend: residuals of (1a) and their derivatives by differences."""
        wheel = cf.PythonModel(Wheel)
        rng = np.random.default_rng(2)
        x = 0.4 + 0.3 * rng.normal(size=6)
        u = np.array([0.3])
        vdot, force, by, force_by = wheel.acceleration_jacobians(x, u, ["rim"])
        self.assertTrue(np.all(np.isfinite(vdot)))
        step = 1e-5   # central: step²·D³ ~ 1e-9, rounding 1e-16·1e2/1e-5 = 1e-9
        for k in range(7):
            z = np.concatenate([x, u])
            e = step * np.eye(7)[k]
            values = [wheel.accelerations((z + s * e)[:6], (z + s * e)[6:], ["rim"]) for s in (1, -1)]
            np.testing.assert_allclose(by[:, k], (values[0][0] - values[1][0]) / (2 * step), atol=1e-6)
            np.testing.assert_allclose(force_by[:, k], (values[0][1] - values[1][1]) / (2 * step),
                                       atol=1e-6)

    def test_bends_and_parameters_by_quotients(self):
        """A run with impacts on curved gaps: the derivative by state, input and all parameters against
        one-sided quotients."""
        wheel = cf.PythonModel(Wheel)
        run = wheel.simulate(relative_tolerance=1e-11, absolute_tolerance=1e-11)
        self.assertGreater(len(run.events), 0)
        B = run.derivative(by=["inputs", "parameters"])
        self.assertTrue(B.status, B.status)
        w = np.random.default_rng(3).normal(size=B.shape[1])
        report = B.compare(w, [1e-3, 1e-4])
        self.assertAlmostEqual(1, report.slope, delta=0.05)
        # Error of a quotient ≈ α·curvature: from the one at 1e-3, ten times less at 1e-4.
        self.assertLess(report.samples[1].error, 0.15 * report.samples[0].error)

    def test_closures(self):
        """A pendulum by its angle, and in the plane with a rod: the same motion and derivative."""
        L, angle, T = Pendulum.parameters["length"], 0.9, 1.5
        tight = dict(relative_tolerance=1e-12, absolute_tolerance=1e-12)
        one = cf.PythonModel(Pendulum).simulate([angle, 0], T, **tight)
        two = cf.PythonModel(Rod).simulate(**tight)
        self.assertTrue(two.status, two.status)
        self.assertEqual(1, len(one.events))
        self.assertAlmostEqual(one.events[0].t, two.events[0].t, delta=1e-9)
        end, rate = one.final_state
        self.assertLess(largest(two.final_state[:2] - L * np.array([np.sin(end), -np.cos(end)])), 1e-8)
        # δx = L cos θ δθ, δz = L sin θ δθ, at the start and at the end
        slope = one.derivative(tolerance=1e-11)([1, 0])[0]
        w = np.array([L * np.cos(angle), L * np.sin(angle), 0, 0])
        value = two.derivative(tolerance=1e-11)(w)
        self.assertLess(largest(value[:2] - slope * L * np.array([np.cos(end), np.sin(end)])), 1e-7)
        # by parameters that leave the start where it is
        by = ["mass", "gravity", "restitution"]
        first, second = (run.derivative(by=by, tolerance=1e-11).jacobian() for run in (one, two))
        np.testing.assert_allclose(second[0, 4:], L * np.cos(end) * first[0, 2:], atol=1e-7)

    def test_a_parameter_that_changes_nothing(self):
        """The mass of a pendulum: what rounding leaves of it costs nothing, though the arc begins without acceleration."""
        tight = dict(relative_tolerance=1e-12, absolute_tolerance=1e-12)
        run = cf.PythonModel(Pendulum).simulate([0, 1.2], 0.5, **tight)
        derivative = run.derivative(by=["mass"], tolerance=1e-11, max_seconds=20)
        self.assertTrue(derivative.status, derivative.status)
        self.assertLess(largest(derivative([0, 0, 1])), 1e-12)

    def test_circles(self):
        pendulum = cf.PythonModel(Pendulum)
        apart = pendulum.separation([0.1 + 2 * np.pi, 0], [0.2, 0])
        np.testing.assert_allclose(apart, [-0.1, 0], atol=1e-14)

    def test_energy_is_kept(self):
        """Coriolis terms: of the free wheel in its potential, T + V is constant."""
        wheel = cf.PythonModel(Wheel, gravity=0, damping=0)
        run = wheel.simulate(wheel.state(**{"z": 5, "d/dt angle": 2, "d/dt x": 1, "d/dt z": 0.5}), 2, [0],
                             relative_tolerance=1e-11, absolute_tolerance=1e-11)
        self.assertEqual((), run.events)
        energy = [0.5 * x[3:] @ wheel.mass_matrix(x[:3]) @ x[3:] for x in run.x(np.linspace(0, 2, 20))]
        self.assertLess(np.ptp(energy), 1e-8)


class AsSystems(unittest.TestCase):
    def test_parameters_and_pickle(self):
        biped = cf.PythonModel(SoftBiped, stiffness=30)
        self.assertEqual(30, biped.parameters["stiffness"])
        self.assertEqual(35, biped.with_parameters(stiffness=35).parameters["stiffness"])
        again = pickle.loads(pickle.dumps(biped))
        self.assertEqual(biped.parameters, again.parameters)
        run = biped.simulate(duration=1.2)
        np.testing.assert_array_equal(run.final_state, pickle.loads(pickle.dumps(run)).final_state)
        self.assertIs(SoftBiped, biped.formulas)

    def test_refusals(self):
        class Bad(SoftBiped):
            """One formula at a time is broken."""

        def check(kind, pattern, **changes):
            broken = type("Broken", (Bad,), changes)
            with self.assertRaisesRegex(kind, pattern):
                cf.PythonModel(broken).simulate(duration=1.2).derivative()

        check(ValueError, "force.*shape.*expected", force=lambda self, q, v, u: [1.0, 2.0])
        check(ValueError, "gaps.*shape", gaps=lambda self, q: [q[4]])
        check(TypeError, "something else than numbers", force=lambda self, q, v, u: ["a"] * 7)
        check(ZeroDivisionError, "", force=lambda self, q, v, u: [1 / 0] * 7)
        check(ValueError, r"restitutions\(\) is \[1.5, 0", restitutions=lambda self: [1.5, 0])
        check(ValueError, "not symmetric", mass_matrix=lambda self, q: np.eye(7) + np.eye(7, k=1))
        check(ValueError, "not symmetric",   # but at the nominal place
              mass_matrix=lambda self, q: np.eye(7) + q[6] * np.eye(7, k=1))
        check(TypeError, r"force\(q, v, u\) has complex numbers", force=lambda self, q, v, u: [np.complex128(1j)] * 7)
        check(TypeError, r"gaps\(q\) has masked numbers", gaps=lambda self, q: np.ma.masked_less(q[4:6], 9.0))
        check(ValueError, r"force\(q, v, u\) gives another result when it is asked again",
              force=lambda self, q, v, u: np.random.random() + 0 * q)
        check(ValueError, "constant_mass is True", constant_mass=True,
              mass_matrix=lambda self, q: np.eye(7) * (1 + q[0] ** 2))
        check(ValueError, "affine_constraints is True", affine_constraints=True,
              gaps=lambda self, q: [q[4] * q[5], q[5]])
        check(ValueError, "x has shape .13", nominal=lambda self: (np.zeros(13), [], 1.0))
        check(ValueError, "constraints has 'left_foot' twice", constraints=("left_foot", "left_foot"))
        check(ValueError, "65 constraints, at most 64", constraints=tuple("c%d" % k for k in range(65)))
        check(ValueError, "units has 2", units=("m", "m"))
        check(ValueError, "cannot be called 'force'", parameters={"force": 1})
        check(ValueError, "'mass' is -1.0, expected positive",
              parameters=dict(SoftBiped.parameters, mass=(-1, "kg", "", "positive")))
        with self.assertRaisesRegex(ValueError, "unknown parameter 'stifness'"):
            cf.PythonModel(SoftBiped, stifness=1)
        with self.assertRaisesRegex(TypeError, "expected a subclass"):
            cf.PythonModel(3)

    def test_what_formulas_keep_of_parameters(self):
        """A value that is computed once has derivatives, too: of ẍ = −k l² x by k and l, beside that without."""
        class Kept(cf.Formulas):
            coordinates = ("x",)
            parameters = {"k": 2.0, "l": 1.5}

            @functools.cached_property
            def stiffness(self):
                return self.k * self.l ** 2

            def mass_matrix(self, q):
                return [[1.0]]

            def force(self, q, v, u):
                return [-self.stiffness * q[0]]

            def nominal(self):
                return [1.0, 0.0], [], 0.7

        B = cf.PythonModel(Kept).simulate().derivative(by=["parameters"])
        w, T = math.sqrt(2.0) * 1.5, 0.7   # x = cos ω t; by ω: −T sin ω T; ω = l √k
        by_omega = np.array([-T * math.sin(w * T), -math.sin(w * T) - w * T * math.cos(w * T)])
        np.testing.assert_allclose(B.jacobian()[:, 2:], np.outer(by_omega, [w / 4, w / 1.5]), atol=1e-8)

    def test_what_would_drop_derivatives_is_an_error(self):
        class Silent(SoftBiped):
            def force(self, q, v, u):
                f = np.zeros(7)   # of floats
                f[3] = -self.gravity - 0.1 * math.sin(q[3])
                return f

        model = cf.PythonModel(Silent)
        run = model.simulate(duration=0.5)   # floats: fine
        with self.assertRaises(TypeError):
            run.derivative()("+body_z")


if __name__ == "__main__":
    case.main()
