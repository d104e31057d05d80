#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives and what is made of them: pieces, radii, quotients, gradients that others get wrong."""
import json
import math
import unittest

import numpy as np

import contact_flow as cf
import case
from case import largest


class Derivatives(unittest.TestCase):
    def setUp(self):
        self.biped = cf.Model("soft_biped")
        self.B = self.biped.simulate().derivative(by=["state", "stiffness"])

    def test_directions(self):
        B = self.B
        self.assertEqual((14, 15), B.shape)
        self.assertEqual(("body_pitch", "stiffness"), (B.tangents[6], B.tangents[-1]))
        w = np.zeros(15)
        w[6] = 1
        for same in (w, w[:14], list(w), "body_pitch", "+body_pitch", {"body_pitch": 1}):
            np.testing.assert_array_equal(B(w), B(same))
        np.testing.assert_array_equal(B(-w), B("-body_pitch"))
        np.testing.assert_array_equal(B(np.array([w, -w])), [B(w), B(-w)])
        np.testing.assert_allclose(B(w, dt=0.5), B(w) + 0.5 * B.time, rtol=1e-14)
        self.assertGreater(largest(B(w) + B(-w)), 0.1)

    def test_directions_of_what_shares_a_name(self):
        urdf = ('<robot name="r"><link name="world"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" '
                'izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="knee" type="prismatic"><parent '
                'link="world"/><child link="b"/><axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="9" '
                'velocity="9"/></joint></robot>')
        robot = cf.Robot.from_strings(urdf, json.dumps({
            "base": "fixed", "constraints": {}, "nominal": {"duration": 0.5},
            "efforts": {"knee": {"kind": "servo", "joint": "knee", "input": "knee", "stiffness": 4, "damping": 1}}}))
        B = robot.simulate().derivative(by=["inputs"])
        self.assertEqual(("knee", "d/dt knee", "input knee"), B.tangents)
        np.testing.assert_array_equal(B.direction("-input knee"), [0, 0, -1])
        np.testing.assert_array_equal(B.direction({"input knee": 2}), [0, 0, 2])
        np.testing.assert_array_equal(B.direction("+knee"), [1, 0, 0])
        pendulum = cf.Model("double_pendulum").simulate(duration=0.1).derivative(by=["inputs", "m1"])
        np.testing.assert_array_equal(pendulum.direction("input shoulder_torque"), [0, 0, 0, 0, 1, 0, 0])
        np.testing.assert_array_equal(pendulum.direction("+parameter m1"), [0, 0, 0, 0, 0, 0, 1])
        with self.assertRaises(ValueError):
            pendulum.direction("input m1")

    def test_pieces(self):
        pieces = self.B.pieces()
        self.assertEqual(2, len(pieces))
        a, b = pieces
        self.assertEqual([["left_foot", "right_foot"]], a.omega)
        self.assertLessEqual(largest(a.cone + b.cone), 1e-12)
        self.assertGreater(pieces.kink, 0.1)
        for piece in pieces:
            w = piece.cone[0]   # the normal lies inside
            self.assertTrue(piece.contains(w))
            np.testing.assert_allclose(piece.matrix @ w, self.B(w), rtol=1e-9, atol=1e-12)
            self.assertEqual(piece.matrix.tolist(), pieces[pieces.piece_at(w)].matrix.tolist())
        self.assertTrue(pieces.consistency())
        with self.assertRaises(IndexError):
            pieces[2]
        with self.assertRaisesRegex(cf.NoDerivative, "one-sided"):
            self.B.jacobian()

    def test_jacobian(self):
        run = self.biped.simulate({"body_pitch": 0.1})
        B = run.derivative(by=["parameters"])
        self.assertTrue(B.is_differentiable)
        J = B.jacobian()
        self.assertEqual((14, 14 + 8), J.shape)
        for k in (0, 6, 13, 20):
            np.testing.assert_allclose(J[:, k], B(np.eye(22)[k]), atol=1e-9 * largest(J))

    def test_quotients(self):
        report = self.B.compare({"body_pitch": 1, "stiffness": 2}, [1e-3, 1e-4, 1e-5])
        self.assertAlmostEqual(1, report.slope, delta=0.01)   # first order is right: errors fall like α
        self.assertEqual([1e-3, 1e-4, 1e-5], [sample.alpha for sample in report.samples])
        self.assertIn("slope", str(report))

    def test_radius_modes_error(self):
        radius = self.B.radius("+body_pitch")
        self.assertGreater(float(radius), 0.01)
        self.assertEqual([(), ("left_foot",), ("left_foot", "right_foot")],
                         self.B.perturbed_modes("+body_pitch"))
        # Well inside the radius the events are those that the derivative unites.
        run = self.biped.simulate({"body_pitch": 0.2 * float(radius)})
        self.assertEqual(self.B.perturbed_modes("+body_pitch"), run.modes)
        self.assertLess(largest(self.B.error("+body_pitch")), 1e-5)
        exact = self.biped.simulate(relative_tolerance=1e-13, absolute_tolerance=1e-13).derivative(tolerance=1e-13)
        off = largest(self.B("+body_pitch") - exact("+body_pitch"))
        self.assertLessEqual(off, largest(self.B.error("+body_pitch")))
        # An error far below the tolerance, 1e-9, is so by chance.
        self.assertLess(largest(self.B.error("+body_pitch")), 100 * off + 1e-10)
        self.assertLess(self.B.trust.flow_law, 1e-6)

    def test_error_without_time_for_the_second_run(self):
        """Estimated then, and measured when there is time again."""
        B = self.biped.simulate().derivative()
        estimated = B.error("+body_pitch", max_seconds=1e-6)
        measured = B.error("+body_pitch")
        self.assertGreater(largest(estimated), 0)
        self.assertGreater(largest(estimated - measured), 0)
        np.testing.assert_array_equal(measured, B.error("+body_pitch", max_seconds=1e-6))  # it is there
        with self.assertRaisesRegex(ValueError, "max_seconds"):
            B.error("+body_pitch", max_seconds=-1)

    def test_error_at_the_least_tolerances(self):
        for tolerance in (1e-13, 5e-14, 1e-15):
            run = self.biped.simulate(relative_tolerance=1e-9, absolute_tolerance=tolerance)
            self.assertLess(largest(run.derivative().error("+body_pitch")), 1e-5)

    def test_linearize(self):
        robot = cf.Robot(case.ROBOTS / "monoped.yaml")
        duration = robot.nominal.duration
        t = np.linspace(0, duration, 5)[:4]
        U = np.tile(robot.nominal.u, (4, 1))
        run = robot.simulate(inputs=cf.Grid(t, U), relative_tolerance=1e-11, absolute_tolerance=1e-11)
        intervals = run.linearize()
        self.assertEqual(4, len(intervals))
        for interval in intervals:
            self.assertTrue(interval.status, interval.status)
        A = np.linalg.multi_dot([interval.A for interval in reversed(intervals)])
        B = run.derivative()
        if B.is_differentiable:
            np.testing.assert_allclose(A, B.jacobian(), atol=1e-6 * largest(A))
        self.assertEqual((2 * robot.dof, 4 * len(robot.inputs)), run.input_map().shape)
        self.assertEqual(4, len(run.linearize(max_seconds=600)))
        for late in (run.linearize, run.input_map):
            with self.assertRaisesRegex(cf.BudgetExceeded, "max_seconds"):
                late(max_seconds=1e-9)
            with self.assertRaisesRegex(ValueError, "max_seconds is -1"):
                late(max_seconds=-1)

    def test_budgets(self):
        run = cf.Robot(case.ROBOTS / "quadruped.yaml").simulate()
        late = run.derivative(max_seconds=1e-9)
        self.assertFalse(late.status)
        self.assertEqual("budget_exceeded", late.status.outcome.replace(" ", "_"))
        with self.assertRaisesRegex(cf.NoDerivative, "budget"):
            late.pieces()
        radius = self.biped.simulate().derivative().radius
        with self.assertRaises(cf.BudgetExceeded):
            radius("+body_pitch", max_seconds=1e-9)
        self.assertGreater(float(radius("+body_pitch", max_seconds=600)), 0)  # what was not done is begun anew

    def test_misuse(self):
        with self.assertRaisesRegex(ValueError, "w has 3 numbers, expected 15"):
            self.B([1, 2, 3])
        with self.assertRaisesRegex(ValueError, "not finite"):
            self.B(np.full(15, np.inf))
        with self.assertRaisesRegex(ValueError, "body_ptch.*body_pitch"):
            self.B("+body_ptch")
        with self.assertRaisesRegex(ValueError, "stifness.*stiffness"):
            self.B.run.derivative(by=["stifness"])
        with self.assertRaisesRegex(TypeError, "by is one text"):
            self.B.run.derivative(by="inputs")
        with self.assertRaisesRegex(ValueError, "twice"):
            self.B.run.derivative(by=["stiffness", "stiffness"])
        with self.assertRaisesRegex(ValueError, "tolerance"):
            self.B.run.derivative(tolerance=0)
        with self.assertRaisesRegex(ValueError, "alphas has 0"):
            self.B.compare("+body_pitch", [0])


class OthersGetWrong(unittest.TestCase):
    """Gradients through contact that finite differences of time-stepping miss, against closed forms."""

    def test_ball_on_the_ground(self):
        """A ball dropped from z₀ bounces with γ: for t > t₁ = √(2z₀/g),
        z = γ v₁ (t−t₁) − ½ g (t−t₁)²,  v₁ = √(2 g z₀). Time-stepping with a fixed step returns a
        gradient dz/dz₀ of the wrong sign."""
        ball = cf.Model("bouncing_ball")
        g, gamma, z0, t = ball.parameters["gravity"], float(ball.restitution[0]), 1.0, 0.6
        x0 = ball.state(**{ball.coordinates[-1]: z0})
        run = ball.simulate(x0, t)
        v1, t1 = math.sqrt(2 * g * z0), math.sqrt(2 * z0 / g)
        self.assertEqual(1, len(run.events))
        self.assertAlmostEqual(t1, run.events[0].t, places=9)
        s = t - t1
        dv1, dt1 = g / v1, 1 / v1
        slope = gamma * (dv1 * s - v1 * dt1) + g * s * dt1
        height = ball.coordinates[-1]
        self.assertAlmostEqual(slope, run.derivative()("+" + height)[ball.dof - 1], places=7)

    def test_ball_on_elastic_ground(self):
        """No gravity, a spring of stiffness k as ground: half a period in contact, so that
        z(T) = v (T − π √(m/k)) − h for a ball thrown down with v from h."""
        class Elastic(cf.Formulas):
            coordinates = ("z",)
            constraints = compliant = ("ground",)
            parameters = {"mass": 0.7, "stiffness": 300.0}
            constant_mass = affine_constraints = contact_effort = True

            def mass_matrix(self, q):
                return [[self.mass]]

            def force(self, q, v, u, mode):
                return [-self.stiffness * q[0] if "ground" in mode else 0.0]

            def gaps(self, q):
                return [q[0]]

        ball, h, v, T = cf.PythonModel(Elastic), 1.0, 2.0, 1.0
        m, k = 0.7, 300.0
        run = ball.simulate([h, -v], T, relative_tolerance=1e-12, absolute_tolerance=1e-12)
        self.assertEqual([("switch",), ("switch",)], [event.kinds for event in run.events])
        self.assertAlmostEqual(v * (T - math.pi * math.sqrt(m / k)) - h, run.final_state[0], places=10)
        B = run.derivative(by=["stiffness", "mass"], tolerance=1e-11)
        pause = math.pi * math.sqrt(m / k)
        wanted = [-1, -(T - pause), v * pause / (2 * k), -v * pause / (2 * m)]
        np.testing.assert_allclose(B.jacobian()[0], wanted, atol=1e-8)
        np.testing.assert_allclose(B.jacobian()[1], [0, -1, 0, 0], atol=1e-8)

    def test_corner(self):
        """An elastic ball without gravity in a corner, both walls at once: its path is mirrored twice,
        x(T) = −(x₀ + T v₀), whatever the order."""
        class Corner(cf.Formulas):
            coordinates = ("x", "z")
            constraints = ("wall", "floor")
            parameters = {"restitution": 1.0}
            constant_mass = affine_constraints = True

            def mass_matrix(self, q):
                return np.eye(2)

            def force(self, q, v, u):
                return [0.0, 0.0]

            def gaps(self, q):
                return [q[0], q[1]]

        B = cf.PythonModel(Corner).simulate([1, 2, -1, -2], 1.5).derivative()
        self.assertTrue(B.is_differentiable)
        np.testing.assert_allclose(B.jacobian(), -np.block([[np.eye(2), 1.5 * np.eye(2)],
                                                            [np.zeros((2, 2)), np.eye(2)]]), atol=1e-8)

    def test_gradient_of_a_cost(self):
        run = cf.Model("soft_biped").simulate()
        B = run.derivative()
        none = run.gradient({"body_z": 0.4})
        self.assertFalse(none)
        self.assertIn("left_foot", none.status.message)
        for sign in (1, -1):
            w = np.zeros(14)
            w[6] = sign
            gradient = run.gradient({"body_z": 0.4}, by=["state", "stiffness"], direction=w)
            self.assertTrue(gradient, gradient.status)
            self.assertFalse(gradient.whole)
            k = list(B.tangents).index("body_z")
            slope = (run.final_state[k] - 0.4) * B(w)[k]
            self.assertAlmostEqual(slope, gradient.initial @ w, delta=1e-8)
            self.assertEqual((1,), gradient.parameters.shape)
        ball = cf.Model("driven_ball").simulate([4, 0], 0.5, cf.Grid([0, 0.25], [[0.0], [0.0]]))
        gradient = ball.gradient({"z": 0}, effort=[2.0], effort_reference=[1.0])
        end = 4 - 9.8 / 8
        # ∂z(T)/∂u: ∫ (T − t) dt over the interval; the effort costs (u − 1)² dt.
        np.testing.assert_allclose(
            gradient.inputs, [[end * 0.09375 - 0.5], [end * 0.03125 - 0.5]], rtol=1e-10)
        self.assertAlmostEqual(end ** 2 / 2 + 0.5, gradient.cost, places=10)
        with self.assertRaisesRegex(ValueError, "nothing costs"):
            ball.gradient()
        with self.assertRaisesRegex(ValueError, "direction"):
            ball.gradient({"z": 0}, direction=[1, 2, 3])

    def test_gradient_of_a_start_in_contact(self):
        """By what moves the contact that the block stands on: with the contact kept, as of runs from there."""
        block = cf.Model("rocking_block")
        run = block.simulate()
        rates = block.velocities[0], block.velocities[-1]
        target = {rates[0]: 0.1, rates[1]: 0.3}
        gradient = run.gradient(target, by=["state", "width", "height"])
        derivative = run.derivative(by=["state", "width", "height"])
        rows = [block.state_names.index(name) for name in target]

        def cost(system, start):
            end = system.simulate(start, run.duration, relative_tolerance=1e-12, absolute_tolerance=1e-12)
            return 0.5 * sum((end.final_state[i] - value) ** 2 for i, value in zip(rows, target.values()))

        for k, name in enumerate(("width", "height")):
            kept = derivative.project("+" + name)
            step = 1e-5
            costs = [cost(block.with_parameters(**{name: block.parameters[name] + sign * step}),
                          block.perturb(run.x0, sign * step * kept[:2 * block.dof])) for sign in (1, -1)]
            self.assertAlmostEqual(gradient.parameters[k], (costs[0] - costs[1]) / (2 * step), places=5)
            self.assertAlmostEqual(0, gradient.initial @ kept[:2 * block.dof], places=6)
        with self.assertRaisesRegex(ValueError, "leaves the contact mode"):
            run.gradient(target, direction=np.eye(2 * block.dof)[1])

    def test_two_balls(self):
        """A head-on collision: of equal elastic balls the one goes on where the other one was, so that
        dx₁(T)/dx₁ = 0 and dx₁(T)/dx₂ = 1; time-stepping gives 1 and 0."""
        class Balls(cf.Formulas):
            coordinates = ("first", "second")
            constraints = ("touch",)
            parameters = {"m1": 1.0, "m2": 1.0, "radius": 0.1, "restitution": 1.0}
            constant_mass = affine_constraints = True

            def mass_matrix(self, q):
                return [[self.m1, 0], [0, self.m2]]

            def force(self, q, v, u):
                return [0.0, 0.0]

            def gaps(self, q):
                return [q[1] - q[0] - 2 * self.radius]

        x1, x2, v1, v2, T, r = 0.0, 1.0, 1.5, -0.5, 1.0, 0.1
        for m1, m2, e in ((1.0, 1.0, 1.0), (1.0, 3.0, 0.6)):
            balls = cf.PythonModel(Balls, m1=m1, m2=m2, restitution=e)
            run = balls.simulate([x1, x2, v1, v2], T)
            J = run.derivative(by=["radius", "restitution"]).jacobian()
            closing = v1 - v2
            t = (x2 - x1 - 2 * r) / closing
            w1 = v1 - m2 * (1 + e) * closing / (m1 + m2)
            self.assertAlmostEqual(x1 + v1 * t + w1 * (T - t), run.final_state[0], places=12)
            jump = (v1 - w1) / closing   # −(v₁ − v₁⁺) dt/dx₁
            slope = m2 * (1 + e) / (m1 + m2)
            dt = t / closing             # dt/dv₂ = −dt/dv₁
            wanted = [1 - jump, jump, t - (v1 - w1) * dt + (1 - slope) * (T - t),
                      (v1 - w1) * dt + slope * (T - t), -2 * jump,
                      -m2 * closing / (m1 + m2) * (T - t)]
            np.testing.assert_allclose(J[0], wanted, atol=1e-8)
            if m1 == m2:
                np.testing.assert_allclose(J[0, :2], [0, 1], atol=1e-8)


if __name__ == "__main__":
    case.main()
