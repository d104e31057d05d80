#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Systems and runs: names, views, inputs, events, and what misuse is answered with."""
import math
import unittest

import numpy as np

import contact_flow as cf
import case
from case import largest


class Systems(unittest.TestCase):
    def test_every_model_has_names_and_a_nominal_run(self):
        self.assertGreaterEqual(len(cf.models()), 16)
        for name in cf.models():
            with self.subTest(name):
                system = cf.Model(name)
                self.assertEqual(system.state_size, len(system.nominal.x))
                self.assertEqual(len(system.inputs), len(system.nominal.u))
                self.assertEqual(system.dof, len(system.velocities))
                self.assertIn(name, repr(system))
                self.assertIn(system.coordinates[0], system.describe())
                run = system.simulate(complete_zeno=True)
                self.assertIn(name, repr(run))
                self.assertEqual((3, system.state_size),
                                 run.x(np.linspace(run.t_begin, run.t_end, 3)).shape)

    def test_parameters(self):
        biped = cf.Model("soft_biped", stiffness=30)
        self.assertEqual(30, biped.parameters["stiffness"])
        heavier = biped.with_parameters(body_mass=2)
        self.assertEqual((30, 2), (heavier.parameters["stiffness"], heavier.parameters["body_mass"]))
        self.assertEqual(1, biped.parameters["body_mass"])
        self.assertEqual(2, heavier.mass_matrix(heavier.nominal.x[:7])[0, 0])
        stiffness = [p for p in biped.parameter_list if p.name == "stiffness"][0]
        self.assertEqual(("N/m", 30), (stiffness.unit, stiffness.value))

    def test_robots(self):
        robot = cf.Robot(case.ROBOTS / "quadruped.yaml")
        self.assertIsInstance(robot, cf.System)
        again = cf.Robot.from_strings(robot.urdf, robot.yaml)
        np.testing.assert_array_equal(robot.simulate().final_state, again.simulate().final_state)
        alone = cf.Robot(case.ROBOTS / "planar_biped.urdf")
        self.assertEqual(alone.coordinates, cf.Robot.from_strings(alone.urdf).coordinates)
        planar = cf.Robot(str(case.ROBOTS / "soft_biped.yaml"))
        # The robot and the model of the same name are one system: the tests of C++ hold them to 1e-9.
        model = cf.Model("soft_biped").simulate(relative_tolerance=1e-12, absolute_tolerance=1e-12)
        run = planar.simulate(duration=model.duration, relative_tolerance=1e-12, absolute_tolerance=1e-12)
        self.assertAlmostEqual(model.events[0].t, run.events[0].t, delta=1e-9)

    def test_limits_of_efforts(self):
        urdf = """<robot name="cart"><link name="world"/><link name="cart"><inertial><mass value="2"/>
          <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
          <joint name="x" type="prismatic"><parent link="world"/><child link="cart"/><axis xyz="1 0 0"/></joint></robot>"""
        servo = "{efforts: {drive: {kind: servo, joint: x, input: u, stiffness: 20, limit: 8}}, nominal: {inputs: {u: 1}}}"
        run = cf.Robot.from_strings(urdf, servo).simulate(duration=0.8)
        (t, effort, before, after), = run.arcs[0].limits
        self.assertEqual(("drive", "upper", "free"), (effort, before, after))
        self.assertAlmostEqual(math.sqrt(0.3), t, delta=1e-9)  # 4 m/s² up to 0.6 m
        self.assertEqual((), cf.Model("soft_biped").simulate().arcs[0].limits)

    def test_places_of_a_robot(self):
        quadruped = cf.Robot(case.ROBOTS / "quadruped.yaml")
        q = quadruped.nominal.x[:quadruped.num_positions]
        at, points = quadruped.link_positions(q), quadruped.contact_points(q)
        self.assertEqual((len(quadruped.links), 3), at.shape)
        self.assertEqual((len(quadruped.constraints), 3), points.shape)
        self.assertEqual(len(quadruped.links), len(quadruped.link_parents))
        self.assertEqual(-1, quadruped.link_parents[0])
        self.assertTrue(all(parent < k for k, parent in enumerate(quadruped.link_parents)))
        # Feet are spheres of 0.02 m over the plane z = 0.
        np.testing.assert_allclose(points[:, 2] - 0.02, quadruped.gaps(q), atol=1e-12)
        many = quadruped.link_positions(np.array([q, q]))
        np.testing.assert_array_equal(many, [at, at])
        with self.assertRaisesRegex(ValueError, "q has not"):
            quadruped.link_positions(q[:-1])

    def test_terms(self):
        pendulum = cf.Model("double_pendulum")
        q, v = np.array([0.3, -0.2]), np.array([0.5, 1.0])
        M = pendulum.mass_matrix(q)
        np.testing.assert_allclose(M, M.T, atol=0)
        gap, jacobian, bias = pendulum.constraint_terms(q, v)
        step = 1e-6   # central differences: error step²·D³a ~ 1e-12, rounding 1e-16/1e-6 = 1e-10
        slope = (pendulum.gaps(q + step * v) - pendulum.gaps(q - step * v)) / (2 * step)
        np.testing.assert_allclose(jacobian @ v, slope, atol=1e-9)
        vdot, force = pendulum.accelerations(np.concatenate([q, v]), mode=())
        np.testing.assert_allclose(M @ vdot, pendulum.force(q, v), atol=1e-12)
        self.assertEqual(0, largest(force))

    def test_perturb_and_separation(self):
        box = cf.Model("falling_box")
        w = 0.1 * np.arange(1.0, 2 * box.dof + 1)
        x = box.perturb(box.nominal.x, w)
        self.assertEqual(box.num_positions + box.dof, len(x))
        np.testing.assert_allclose(box.separation(x, box.nominal.x), w, atol=1e-14)


class Runs(unittest.TestCase):
    def setUp(self):
        self.biped = cf.Model("soft_biped")
        self.run_ = self.biped.simulate(self.biped.state(body_pitch=0.1))

    def test_status_is_a_value(self):
        run = self.run_
        self.assertTrue(run.status)
        self.assertEqual(("ok", ""), (run.status.outcome, run.status.message))
        stopped = self.biped.simulate(max_steps=3)
        self.assertFalse(stopped.status)
        self.assertEqual("budget_exceeded", stopped.status.outcome.replace(" ", "_"))
        self.assertLess(stopped.t_end, stopped.duration)

    def test_time(self):
        run, first = self.run_, self.run_.events[0]
        np.testing.assert_array_equal(run.x(first.t), first.x_minus, "left-continuous")
        np.testing.assert_array_equal(run.x(run.t_end), run.final_state)
        t = np.linspace(0, 1.4, 7)
        np.testing.assert_array_equal(run.x(t), [run.x(each) for each in t])
        np.testing.assert_array_equal(run.x(list(t)), run.x(t))
        self.assertEqual((0, 14), run.x([]).shape)
        self.assertEqual((), run.mode(first.t))
        self.assertEqual(("left_foot",), run.mode(first.t + 1e-9))
        force = run.force(t)
        self.assertEqual((7, 2), force.shape)
        self.assertEqual(0, largest(force[0]))
        self.assertGreater(min(force[-1]), 0)

    def test_events_and_arcs(self):
        run = self.run_
        self.assertEqual([("left_foot",), ("right_foot",)], [e.activated for e in run.events])
        self.assertEqual([("touchdown",)] * 2, [e.kinds for e in run.events])
        self.assertEqual(["oo", "lo", "ll"], run.mode_words)
        event = run.events[0]
        self.assertEqual(((), ("left_foot",)), (event.mode_before, event.mode_after))
        # (1b): M (v⁺ − v⁻) = Daᵀ p
        change = self.biped.mass_matrix(event.x_minus[:7]) @ (event.x_plus - event.x_minus)[7:]
        _, jacobian, _ = self.biped.constraint_terms(event.x_minus[:7], event.x_minus[7:])
        np.testing.assert_allclose(change, jacobian.T @ event.impulse, atol=1e-14)
        self.assertEqual([0, event.t], [run.arcs[0].t_begin, run.arcs[0].t_end])
        np.testing.assert_array_equal(run.arcs[1].x_begin, event.x_plus)
        self.assertIn("touchdown of left_foot", repr(event))

    def test_views_outlive_their_owners_and_are_read_only(self):
        impulse = cf.Model("soft_biped").simulate().events[0].impulse
        np.testing.assert_allclose(impulse, [1, 1], rtol=1e-12)   # 1 kg at 1 m/s each
        with self.assertRaises(ValueError):
            impulse[0] = 2
        nominal = cf.Model("soft_biped").nominal.x
        self.assertEqual(1, nominal[3])
        with self.assertRaises(ValueError):
            nominal[0] = 2

    def test_samples_and_csv(self):
        t, x = self.run_.samples(50)
        self.assertEqual(len(t), len(x))
        self.assertTrue(np.all(np.diff(t) >= 0))
        rows = self.run_.csv(50).strip().split("\n")
        self.assertEqual(len(t) + 1, len(rows))
        self.assertIn("body_pitch", rows[0])

    def test_warnings_margins_statistics(self):
        ball = cf.Model("bouncing_ball").simulate(duration=3, complete_zeno=True)
        self.assertTrue(ball.status, ball.status)
        self.assertEqual("zeno", ball.warnings[0].code)
        self.assertIn("zeno", [kind for event in ball.events for kind in event.kinds])
        self.assertTrue(math.isinf(self.run_.margins.release_rate))
        self.assertGreater(self.run_.margins.approach_speed, 0.5)
        self.assertGreater(self.run_.statistics.steps, 5)

    def test_inputs(self):
        robot = cf.Robot(case.ROBOTS / "monoped.yaml")
        u = robot.nominal.u
        name = robot.inputs[0]
        constant = robot.simulate(inputs=u + 0.5)
        named = robot.simulate(inputs={n: value + 0.5 for n, value in zip(robot.inputs, u)})
        np.testing.assert_array_equal(constant.final_state, named.final_state)
        t = np.linspace(0, constant.duration, 4)[:3]
        grid = robot.simulate(inputs=cf.Grid(t, np.tile(u + 0.5, (3, 1))))
        self.assertLess(largest(grid.final_state - constant.final_state), 1e-6)   # steps are cut
        # The motion before an instant of the grid does not depend on what comes from it on.
        other = robot.simulate(inputs=cf.Grid(t, [u + 0.5, u, u]))
        np.testing.assert_array_equal(grid.x(t[1]), other.x(t[1]))
        self.assertGreater(largest(grid.final_state - other.final_state), 1e-6)
        np.testing.assert_array_equal(other.u(t[1] + 1e-6), u)
        with self.assertRaisesRegex(ValueError, "inputs: unknown name 'no%s'.*%s" % (name, name)):
            robot.simulate(inputs={"no" + name: 1})

    def test_by_name(self):
        run = self.biped.simulate({"body_pitch": 0.1})
        np.testing.assert_array_equal(run.final_state, self.run_.final_state)

    def test_online_is_the_same_to_the_bit(self):
        whole = self.biped.simulate({"body_pitch": 0.1}, 2)   # the horizon cuts its last step: further on
        flow = self.biped.online({"body_pitch": 0.1})
        seen = []
        for t in np.linspace(0, 1.4, 29)[1:]:
            while (event := flow.advance_to(t)) is not None:
                seen.append(event["t"])
            np.testing.assert_array_equal(whole.x(t), flow.x)
        self.assertEqual([event.t for event in whole.events if event.t <= 1.4], seen)
        self.assertEqual(("left_foot", "right_foot"), flow.mode)
        with self.assertRaisesRegex(ValueError, "before now"):
            flow.advance_to(0.1)

    def test_the_derivative_since_a_mark(self):
        """Beside that of the whole run, and, from a mark on the way, of the run that begins there; to the tolerance 1e-9."""
        flow, x = self.biped.online({"body_pitch": 0.1}), self.biped.state(body_pitch=0.1)
        with self.assertRaisesRegex(ValueError, "no instant is marked"):
            flow.tangents
        flow.mark(by=["stiffness"])   # all directions
        for t in (0.3, 0.99, 1.3):
            while flow.advance_to(t) is not None:
                pass
            now, B = flow.tangents, self.biped.simulate(x, t).derivative(by=["stiffness"])
            self.assertEqual((0, t), (now.t_mark, now.t))
            np.testing.assert_array_equal(now.directions, np.eye(15))
            np.testing.assert_allclose(now.tangents, B(np.eye(15)), atol=1e-7)
            np.testing.assert_allclose(now.time, B.time, atol=1e-9)
        flow = self.biped.online(x)
        flow.advance_to(0.5)
        flow.mark(["-body_pitch", {"d/dt body_z": 2.0}])
        while flow.advance_to(1.2) is not None:
            pass
        later = self.biped.simulate(self.biped.simulate(x, 0.5).final_state, 0.7).derivative()
        np.testing.assert_allclose(flow.tangents.tangents, [later("-body_pitch"), 2 * later("+d/dt body_z")], atol=1e-7)
        flow.unmark()
        with self.assertRaisesRegex(ValueError, "no instant is marked"):
            flow.tangents
        self.assertGreater(flow.statistics.steps, 5)

    def test_marks_that_are_refused(self):
        puck = cf.Model("puck").online()
        with self.assertRaisesRegex(ValueError, r"directions\[1\] leaves the contact mode {floor}"):
            puck.mark(["+x", "-z"])
        with self.assertRaisesRegex(TypeError, "is one direction, expected a sequence"):
            puck.mark("+x")
        puck.mark()   # projected: what leads into the floor is no direction
        self.assertEqual(0, largest(puck.tangents.directions[2]))
        rigid = cf.Model("rigid_biped")
        flow = rigid.online()
        flow.mark()
        flow.advance_to(rigid.nominal.duration)
        self.assertEqual("discontinuous", flow.tangents.status.outcome)

    def test_forces_that_jump(self):
        """Of a foot that rests while another lands: what the accelerations say behind the impact."""
        run = cf.Model("soft_biped").simulate({"body_pitch": 0.1})
        first, second = run.force_jumps()
        self.assertEqual(({"left_foot"}, True), (set(first["contacts"]), first["computed"]))
        resting = second["contacts"]["left_foot"]
        self.assertEqual("keeps", resting["fate"])
        _, force = run.system.accelerations(run.events[1].x_plus, mode=run.events[1].mode_after)
        (_, before, _), (activated, after, _) = resting["stages"]
        self.assertEqual(("right_foot",), activated)
        self.assertAlmostEqual(force[0], after, delta=1e-9 * force[0])
        self.assertAlmostEqual(run.force(run.events[1].t)[0], before, delta=1e-6)

    def test_assumptions(self):
        quadruped = cf.Model("rigid_biped").simulate()
        report = quadruped.assumptions()[0]
        self.assertEqual("order dependent", report.contact_class.replace("-", " "))
        self.assertTrue(report.independent)
        self.assertEqual(1, len(report.couplings))
        region = self.biped.assumptions_over(np.full(14, 0.1), samples=20)
        self.assertEqual((20, 20), (region["samples"], region["smooth"]))


class Misuse(unittest.TestCase):
    """Exceptions name field and value; nothing is computed."""

    def check(self, kind, pattern, call):
        with self.assertRaisesRegex(kind, pattern):
            call()

    def test_systems(self):
        self.check(ValueError, "sft_biped.*soft_biped", lambda: cf.Model("sft_biped"))
        self.check(ValueError, "stifness.*stiffness", lambda: cf.Model("soft_biped", stifness=1))
        self.check(ValueError, "body_mass.*-1", lambda: cf.Model("soft_biped", body_mass=-1))
        self.check(TypeError, "'body_mass' is 'x'", lambda: cf.Model("soft_biped", body_mass="x"))
        self.check(ValueError, "no_such.yaml", lambda: cf.Robot("no_such.yaml"))
        self.check(ValueError, "xml|XML|URDF", lambda: cf.Robot.from_strings("<robot", ""))

    def test_runs(self):
        biped = cf.Model("soft_biped")
        self.check(ValueError, r"x0 has shape 3, expected 14 numbers: body_x",
                   lambda: biped.simulate([1, 2, 3]))
        self.check(ValueError, r"x0 has shape 2×14", lambda: biped.simulate(np.zeros((2, 14))))
        self.check(TypeError, "x0 .*complex", lambda: biped.simulate(np.zeros(14, dtype=complex)))
        self.check(TypeError, "x0", lambda: biped.simulate("abc"))
        self.check(ValueError, "nan", lambda: biped.simulate(np.full(14, np.nan)))
        self.check(ValueError, "left_foot", lambda: biped.simulate(biped.state(left_foot_z=-0.1)))
        self.check(ValueError, "body_ptch.*body_pitch", lambda: biped.simulate({"body_ptch": 1}))
        self.check(ValueError, "duration is -1", lambda: biped.simulate(duration=-1))
        self.check(TypeError, "duration is 'long'", lambda: biped.simulate(duration="long"))
        self.check(TypeError, "relativ_tolerance.*relative_tolerance",
                   lambda: biped.simulate(relativ_tolerance=1e-9))
        self.check(ValueError, "relative_tolerance", lambda: biped.simulate(relative_tolerance=-1))
        self.check(TypeError, "max_steps is 1.5", lambda: biped.simulate(max_steps=1.5))
        self.assertTrue(biped.simulate(dense=np.bool_(True)).options["dense"])
        self.check(TypeError, r"max_steps is (np\.)?True", lambda: biped.simulate(max_steps=np.bool_(True)))
        self.check(TypeError, "complete_zeno is 'no'", lambda: biped.simulate(complete_zeno="no"))
        self.check(ValueError, "impact_law.*projection", lambda: biped.simulate(impact_law="projectio"))
        self.check(ValueError, "method.*implicit", lambda: biped.simulate(method="implizit"))
        run = biped.simulate()
        self.check(ValueError, "t is 2.0 s, outside the run, 0.0 to 1.4", lambda: run.x(2))
        self.check(ValueError, "t is nan", lambda: run.x([0, math.nan]))
        self.check(ValueError, "dense", lambda: biped.simulate(dense=False).x(0.5))
        self.check(ValueError, "dense", lambda: biped.simulate(dense=False).derivative())
        self.check(ValueError, r"\[K\]", lambda: cf.Grid([0, 1], np.zeros((3, 1))))


if __name__ == "__main__":
    case.main()
