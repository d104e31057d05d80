#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Return maps, orbits, stability with certificates, controllability, covariance, optimisation."""
import math
import pickle
import unittest

import numpy as np

import contact_flow as cf
import case
from case import largest

SHIFT = ["body_x", "left_foot_x", "right_foot_x"]
TROT = [{"kind": "period", "value": 0.8}, {"kind": "coordinate", "name": "body_z", "value": 0.8},
        {"kind": "touchdown", "name": "left_foot", "value": 0.1},
        {"kind": "touchdown", "name": "left_foot", "other": "right_foot"},
        {"kind": "lift_off", "name": "left_foot", "value": 0.7},
        {"kind": "lift_off", "name": "left_foot", "other": "right_foot"}]


def trot(name):
    data = case.reference(name)
    return cf.Model(data["model"], **data["parameters"]), case.state(data["initial_state"])


TABLE = """<robot name="table"><link name="world"/><link name="ball"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="z" type="prismatic">
<parent link="world"/><child link="ball"/><axis xyz="0 0 1"/>
<limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>"""


class Sled(cf.Formulas):
    """x is pushed along by its own speed and drawn to 0, z comes to rest at 0."""

    coordinates = ("x", "z")
    parameters = {"gain": 0.0, "stiffness": 0.0}
    constant_mass = True

    def mass_matrix(self, q):
        return np.eye(2)

    def force(self, q, v, u):
        return [self.gain * v[0] - self.stiffness * q[0], -q[1] - v[1]]


class Pad(cf.Formulas):
    """A ball of mass 1 over a spring that pushes where it is pressed."""

    coordinates, constraints, compliant = ("z",), ("pad",), ("pad",)
    parameters = {"gravity": 10.0, "stiffness": 100.0}
    constant_mass = contact_effort = True

    def mass_matrix(self, q):
        return [[1.0]]

    def force(self, q, v, u, mode):
        return [-self.gravity - (self.stiffness * q[0] if "pad" in mode else 0.0)]

    def gaps(self, q):
        return [q[0]]


class Orbits(unittest.TestCase):
    def test_an_answer_has_a_budget(self):
        system, x = trot("hopping_trot_stable")
        section = cf.Apex("body_z")
        late = system.poincare(section, max_seconds_total=1e-9)
        self.assertEqual("stopped", late(x).status)
        self.assertIn("max_seconds = 1e-09", late(x).message)
        self.assertEqual("cancelled", late.fixed_point(x).status)
        self.assertEqual("returned", system.poincare(section, max_seconds_total=60)(x).status)
        with self.assertRaisesRegex(ValueError, "max_seconds_total is 0"):
            system.poincare(section, max_seconds_total=0)

    def test_a_touchdown_on_a_pad_is_a_section(self):
        """Back after the pressing and the flight, at the same speed v: T = 2 v/g + 2 (π − atan(ω v/g))/ω."""
        for v in (0.5, 2.0, 5.0):
            back = cf.PythonModel(Pad).poincare(cf.Touchdown("pad"))([0.0, -v])
            self.assertEqual("returned", back.status, back.message)
            self.assertAlmostEqual(2 * v / 10 + (math.pi - math.atan(v)) / 5, back.time, places=9)
            np.testing.assert_allclose(back.x, [0, -v], atol=1e-9)
            np.testing.assert_allclose(back.return_time([0, -1]), [0.2 - 0.2 / (1 + v * v)], atol=1e-8)
            np.testing.assert_allclose(back.reduced[0].matrix, [[1]], atol=1e-8)
        first = cf.PythonModel(Pad).poincare(cf.Touchdown("pad"))([5.0, 0.0])
        self.assertAlmostEqual(1.0, first.time, places=9)

    def test_a_clock_is_shifted(self):
        """A ball on a table z = A sin(ω t) that is hit once a period T, with e: g T/2 behind each impact, where the
        table rises by (1 − e)/(1 + e) of that. By (t, v) the return is [1, c/g; c a, c² a/g + e²], c = 1 + e, a = −ω² z."""
        gravity, restitution, period, amplitude = 9.81, 0.6, 0.2, 0.01
        table = cf.Robot.from_strings(TABLE, """{base: fixed, constraints: {c: {kind: plane, link: ball, point: [0, 0, 0],
            restitution: 0.6, motion: {direction: [0, 0, 1], amplitude: 0.01, frequency: 5}}}}""")
        speed, w = gravity * period / 2, 2 * np.pi / period
        early = math.acos(speed * (1 - restitution) / (1 + restitution) / (amplitude * w)) / w
        returns = table.poincare(cf.Touchdown("c", shifted={"clock": -period}))
        for t, verdict in ((early, "stable"), (period - early, "unstable")):
            height = amplitude * math.sin(w * t)
            x = table.state(**{"z": height, "clock": t, "d/dt z": speed})
            np.testing.assert_allclose(returns(x).x, x, atol=1e-9)
            orbit = returns.fixed_point(x)
            self.assertTrue(orbit, orbit.message)
            self.assertAlmostEqual(period, orbit.period, places=9)
            stability = orbit.stability()
            self.assertEqual(verdict, stability.verdict)
            c, a = 1 + restitution, -w * w * height
            by_hand = [[1, c / gravity], [c * a, c * c * a / gravity + restitution ** 2]]
            np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(stability.map[0].matrix)),
                                       np.sort_complex(np.linalg.eigvals(by_hand)), atol=1e-6)
            self.assertEqual(verdict, pickle.loads(pickle.dumps(returns)).fixed_point(x).stability().verdict)
        self.assertNotEqual("converged", table.poincare(cf.Touchdown("c")).fixed_point(x).status)
        for shifted, message in (({"tick": 1}, "tick"), ({"clock": float("nan")}, "finite")):
            with self.assertRaisesRegex(ValueError, message):
                table.poincare(cf.Touchdown("c", shifted=shifted))

    def test_a_translation_that_grows_is_none(self):
        def of(gain, stiffness=0.0):
            sled = cf.PythonModel(Sled, gain=gain, stiffness=stiffness)
            return sled.poincare(cf.After(1.0))(np.zeros(4)).stability(translation=["x"])
        self.assertEqual(("stable", (2, 2)), (of(0).verdict, of(0).map.shape))
        self.assertEqual(("stable", (3, 3)), (of(-0.5).verdict, of(-0.5).map.shape))   # the velocity stays
        self.assertEqual("unstable", of(0.5).verdict)
        for stiffness in (-1.0, 1.0):   # x alone is a symmetry no more
            with self.assertRaisesRegex(ValueError, "no symmetry"):
                of(0, stiffness)

    def test_stable_and_unstable_trot(self):
        for name, verdict in (("hopping_trot_stable", "stable"), ("hopping_trot_unstable", "unstable")):
            with self.subTest(name):
                system, x = trot(name)
                back = system.poincare(cf.Apex("body_z"))(x)
                self.assertTrue(back)
                self.assertEqual("returned", back.status)
                self.assertAlmostEqual(0.8, back.time, places=9)
                self.assertLess(largest(back.x - x), 1e-9)
                stability = back.stability(SHIFT)
                self.assertEqual(verdict, stability.verdict)
                self.assertEqual(verdict == "stable", stability.stable)
                self.assertTrue(stability.verify())
                self.assertIn(stability.certificate.test, repr(stability.certificate))
                self.assertEqual(2, len(back.run.events))

    def test_from_a_file_to_stability(self):
        """A robot's run, its derivative, and the gait near it, in the fewest words."""
        robot = cf.Robot(case.ROBOTS / "hopping_trot.yaml")
        x0 = robot.nominal.x.copy()
        run = robot.simulate(x0, duration=0.8, inputs=cf.Grid([0, 0.4], np.zeros((2, 0))))
        self.assertEqual((200, 14), run.x(np.linspace(0, 0.8, 200)).shape)
        self.assertEqual((2, True), (len(run.events[0].impulse), bool(run.status)))
        B = run.derivative(by=["state", "inputs", "push"])
        self.assertEqual(((14,), 2), (B(np.ones(15)).shape, len(B.pieces())))
        self.assertGreater(B.radius(np.ones(15)).radius, 0)
        orbit = robot.poincare(cf.Apex("base_z")).fixed_point(x0, free=["push"])
        self.assertAlmostEqual(0.8, orbit.period, places=9)
        self.assertTrue(orbit.stability(translation=["base_x"]).stable)

    def test_a_trot_that_comes_to_stairs_is_none(self):
        """Every return of a trot that moves on is like the first, but for the stairs in its way."""
        flat = cf.Robot(case.ROBOTS / "hopping_trot.yaml")
        plane, stairs = "left_foot: {kind: plane, link: left_foot}", (
            "left_foot: {kind: stairs, link: left_foot, point: [0, 0, 0], rise: 0.05, run: 1, riser: 0.02, "
            "direction: [1, 0, 0], first: 1, last: 5}")
        self.assertIn(plane, flat.yaml)
        rough = cf.Robot.from_strings(flat.urdf, flat.yaml.replace(plane, stairs))
        for robot, base_x, alike in ((flat, 0.9, True), (rough, -9.0, True), (rough, 0.9, False)):
            x = robot.nominal.x.copy()
            x[0], x[robot.state_names.index("d/dt base_x")] = base_x, 0.5
            back = robot.poincare(cf.Apex("base_z"))(x)
            self.assertAlmostEqual(base_x + 0.4, back.x[0], places=9)
            with self.subTest(robot=robot.yaml == flat.yaml, base_x=base_x):
                if alike:
                    self.assertTrue(back.stability(translation=["base_x"]).stable)
                    continue
                with self.assertRaisesRegex(ValueError, "next return differs"):
                    back.stability(translation=["base_x"])

    def test_finds_the_trot(self):
        system, x = trot("hopping_trot_stable")
        wanted = system.parameters
        off = system.with_parameters(push=wanted["push"] * 1.1, leg_length=wanted["leg_length"] * 0.9)
        orbit = off.poincare(cf.Apex("body_z")).fixed_point(
            x, free=["axial_stiffness", "axial_damping", "push", "leg_length"], conditions=TROT)
        self.assertTrue(orbit, orbit.message)
        # As in test/analysis/periodic_orbit_test.cc, against an independent program.
        for name, value in wanted.items():
            self.assertAlmostEqual(value, orbit.parameters[name], delta=1e-8 * (1 + value))
            self.assertAlmostEqual(value, orbit.system.parameters[name], delta=1e-8 * (1 + value))
        self.assertAlmostEqual(0.8, orbit.period, delta=1e-10)
        self.assertEqual("stable", orbit.stability(SHIFT).verdict)

    @case.needs_linear_programs
    def test_feedback(self):
        trot = cf.Model("steered_trot", hip_offset=0.25)
        apexes = trot.poincare(cf.Apex("body_z"))
        self.assertEqual("unstable", apexes().stability(SHIFT).verdict)
        for piecewise, test in ((False, "words"), (True, "quadratic norm")):
            with self.subTest(piecewise=piecewise):
                feedback = apexes.feedback(translation=SHIFT, piecewise=piecewise)
                self.assertTrue(feedback, feedback.message)
                self.assertTrue(feedback.verify())
                self.assertEqual(test, feedback.certificate.test)
                self.assertEqual((("pitch_torque",), (11, 12), (1, 11)),
                                 (feedback.inputs, feedback.step.shape, feedback.law.shape))
                z = 1e-7 * np.arange(1, 12)
                x = feedback.state(z)
                self.assertLess(largest(feedback.input(x) - feedback.law(z)), 1e-12)
                run = feedback.follow(x, 1)
                self.assertTrue(run)
                after = feedback.basis.T @ (run.x[1] - trot.nominal.x)
                self.assertLess(largest(after - feedback.closed(z)), 1e-3 * largest(feedback.closed(z)))
                self.assertLess(feedback.follow(x, 50).away[-1], 1e-2 * np.linalg.norm(z))
        lost = feedback.follow(feedback.state(np.ones(11)), 20, lost=0.1)
        self.assertEqual(1, len(lost.x))
        with self.assertRaisesRegex(ValueError, "did you mean 'pitch_torque'"):
            apexes.feedback(translation=SHIFT, inputs=["pitch_torqe"])
        with self.assertRaisesRegex(ValueError, "needs an input"):
            trot.poincare(cf.Apex("body_z")).feedback(translation=SHIFT, inputs=[])
        with self.assertRaisesRegex(ValueError, "away from x"):
            apexes.feedback({"body_z": 0.9}, translation=SHIFT)

    def test_elastic_ball(self):
        ball = cf.Model("bouncing_ball", restitution=1)
        height = ball.coordinates[-1]
        z0 = 1.0
        period = 2 * math.sqrt(2 * z0 / ball.parameters["gravity"])
        x = np.zeros(2 * ball.dof)
        x[ball.dof - 1] = z0
        back = ball.poincare(cf.Apex(height))(x)
        self.assertAlmostEqual(period, back.time, places=9)
        self.assertLess(largest(back.x - x), 1e-9)

    def test_misuse(self):
        biped = cf.Model("soft_biped")
        with self.assertRaisesRegex(ValueError, "body_w"):
            biped.poincare(cf.Apex("body_w"))
        with self.assertRaisesRegex(TypeError, "section is 3"):
            biped.poincare(3)
        after = biped.poincare(cf.After(0.5))()
        self.assertAlmostEqual(0.5, after.time)
        with self.assertRaisesRegex(ValueError, "away from x: this is no orbit"):
            after.stability()
        with self.assertRaisesRegex(cf.NoDerivative, "no derivative was asked for"):
            biped.poincare(cf.After(0.5))(derivative=False).map
        never = biped.poincare(cf.Crossing("body_z", 5), horizon=0.5)()
        self.assertFalse(never)
        self.assertIn("no return", never.status.replace("_", " "))
        system, x = trot("hopping_trot_stable")
        with self.assertRaisesRegex(ValueError, "no symmetry"):
            system.poincare(cf.Apex("body_z"))(x).stability(["body_pitch"])
        with self.assertRaisesRegex(ValueError, "lacks 'kind'"):
            system.poincare(cf.Apex("body_z")).fixed_point(x, conditions=[{}])


class Maps(unittest.TestCase):
    """Of maps of one's own, against what is known of them."""

    @case.needs_linear_programs
    def test_of_two_half_planes(self):
        # x ↦ a x for x ≥ 0, b x for x ≤ 0
        for a, b, verdict in ((0.5, 0.9, "stable"), (0.5, 1.2, "unstable"), (-0.5, -1.5, "stable")):
            f = cf.PiecewiseLinearMap([([[a]], [[1.0]]), ([[b]], [[-1.0]])])
            self.assertTrue(f.consistency())
            stability = f.stability()
            self.assertEqual(verdict, stability.verdict, (a, b))   # (-0.5)(-1.5) < 1
            self.assertTrue(stability.verify())
            self.assertEqual([a], f([1.0]).tolist())
            self.assertEqual([[a], [-b]], f([[1.0], [-1.0]]).tolist())

    def test_not_a_map(self):
        gap = cf.PiecewiseLinearMap([([[0.5]], [[1.0]])])
        self.assertFalse(gap.consistency())
        self.assertEqual("gap", gap.consistency().defect)
        self.assertEqual("undetermined", gap.stability().verdict)
        self.assertIsNone(gap.stability().stable)

    @case.needs_linear_programs
    def test_controllability(self):
        absolute = cf.PiecewiseLinearMap([([[1.0]], [[1.0]]), ([[-1.0]], [[-1.0]])])   # |x|
        report = absolute.controllability()
        self.assertEqual("not controllable", report.verdict)
        self.assertLess(report.unattained[0], 0)
        pendulum = cf.Model("double_pendulum")
        inputs = pendulum.simulate(
            inputs=cf.Grid([0, 0.2], np.tile(pendulum.nominal.u, (2, 1)))).input_map()
        self.assertEqual((4, 4), inputs.shape)
        report = inputs.controllability()
        self.assertEqual("controllable", report.verdict)
        self.assertTrue(report.homeomorphism)

    def test_covariance(self):
        """max(w, 0) of a standard normal w: mean 1/√(2π), variance ½ − 1/(2π)."""
        ramp = cf.PiecewiseLinearMap([([[1.0]], [[1.0]]), ([[0.0]], [[-1.0]])])
        moments = ramp.covariance([[1.0]])
        self.assertEqual("truncation", moments.method)
        self.assertAlmostEqual(1 / math.sqrt(2 * math.pi), moments.mean[0], places=14)
        self.assertAlmostEqual(0.5 - 1 / (2 * math.pi), moments.covariance[0, 0], places=14)
        with self.assertRaisesRegex(ValueError, "P has shape 2"):
            ramp.covariance([1.0, 2.0])

    def test_composition_pickle_and_misuse(self):
        f = cf.PiecewiseLinearMap([([[1.0, 0], [0, 2]], [[1.0, 0]]), ([[3.0, 0], [0, 2]], [[-1.0, 0]])])
        g = cf.PiecewiseLinearMap([([[0.0, 1], [1, 0]], None)])
        h = f.after(g)
        for w in np.random.default_rng(1).normal(size=(20, 2)):
            np.testing.assert_allclose(h(w), f(g(w)), atol=1e-14)
        again = pickle.loads(pickle.dumps(f))
        np.testing.assert_array_equal(again[1].matrix, f[1].matrix)
        with self.assertRaisesRegex(ValueError, "one size"):
            cf.PiecewiseLinearMap([([[1.0]], None), ([[1.0, 2.0]], None)])
        with self.assertRaisesRegex(ValueError, "zero"):
            cf.PiecewiseLinearMap([([[1.0]], [[0.0]])])
        with self.assertRaisesRegex(ValueError, "one piece at least"):
            cf.PiecewiseLinearMap([])
        with self.assertRaisesRegex(ValueError, "square"):
            cf.PiecewiseLinearMap([([[1.0, 2.0]], None)]).stability()


class Optimisation(unittest.TestCase):
    def test_torque_law(self):
        """Slopes of the law of examples/torque_law.cc, which is linear to first order on both sides."""
        pendulum = cf.Model("double_pendulum")
        name, elbow = pendulum.inputs[0], pendulum.coordinates[1]
        target = pendulum.simulate(relative_tolerance=1e-12, absolute_tolerance=1e-12).final_state[1]
        for offset, slope in ((-1e-5, -0.4402), (1e-5, -1.5875)):
            x = pendulum.nominal.x.copy()
            x[0] += offset
            found = pendulum.optimize([name], {elbow: target}, x0=x, u=[0, 0], tolerance=1e-10)
            self.assertLess(found.cost, 1e-12, found.message)
            self.assertAlmostEqual(slope, found.y[0] / offset, delta=2e-4)
            self.assertEqual({name: found.y[0]}, found.values)
        with self.assertRaisesRegex(ValueError, "elbw"):
            pendulum.optimize(["elbw"], {elbow: 1})
        with self.assertRaisesRegex(ValueError, "target is empty"):
            pendulum.optimize([name], {})
        with self.assertRaisesRegex(ValueError, "weight has 'shoulder', which has no target"):
            pendulum.optimize([name], {elbow: 1}, weight={"shoulder": 1})


if __name__ == "__main__":
    case.main()
