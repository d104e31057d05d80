#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A loop closed by points, along axes of one of its links: a four-bar on a body that floats and has rolled."""
import json
import unittest

import numpy as np

import case
import contact_flow as cf

OPTIONS = dict(relative_tolerance=1e-11, absolute_tolerance=1e-11)
DURATION = 0.8  # [s]
LOOP = {"link": "shoe", "point": [0.1, 0, 0], "other_link": "rod", "other_point": [0, 0, -0.4], "axes": "xz"}


def link(name, mass, center):
    return (f'<link name="{name}"><inertial><origin xyz="0 0 {center}"/><mass value="{mass}"/><inertia ixx="0.2" iyy="0.3" '
            'izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>')


def hinge(name, parent, child, xyz):
    return (f'<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
            '<axis xyz="0 1 0"/></joint>')


def four_bar(roll, stop=0.9, **loop):
    """Two parallel bars and what they carry, below a body that has rolled about x by this angle and spins about its y, without
    gravity; a stop that the bar reaches."""
    urdf = ('<robot name="r">' + link("body", 2, 0) + link("bar", 0.5, -0.2) + link("rod", 0.4, -0.2) + link("shoe", 0.3, 0) +
            hinge("bar", "body", "bar", "0 0 0") + hinge("rod", "body", "rod", "0.1 0 0") +
            hinge("shoe", "bar", "shoe", "0 0 -0.4") + "</robot>")
    c, s = np.cos(roll / 2), np.sin(roll / 2)
    return cf.Robot.from_strings(urdf, json.dumps({
        "base": "floating", "gravity": 0, "closures": {"loop": {**LOOP, **loop}},
        "constraints": {"stop": {"kind": "upper_limit", "joint": "bar", "upper": stop}},
        "nominal": {"positions": {"base_qw": c, "base_qx": s, "bar": 0.3, "rod": 0.3, "shoe": -0.3},
                    "velocities": {"base_wy": 0.7, "bar": 2.0, "rod": 2.0, "shoe": -2.0}}}))


def of_joints(robot, x):
    """Angles and rates of the three hinges."""
    names = list(robot.state_names)
    first, count = names.index("bar"), robot.num_positions
    return np.concatenate([x[first:first + 3], x[count + 6:count + 9]])


class ClosureFrames(unittest.TestCase):
    """How the body has rolled is nothing to the loop."""

    def ends(self, robot):
        run = robot.simulate(robot.nominal.x, DURATION, **OPTIONS)
        self.assertTrue(run.status.ok, run.status)
        self.assertEqual(1, len(run.events))
        return of_joints(robot, run.final_state)

    def test_axes_that_turn_with_a_link(self):
        """Of either link, at any roll, the motion is the one along axes of the world where the body is upright."""
        upright = self.ends(four_bar(0))
        self.assertGreater(abs(upright[0] - 0.3), 0.1)
        for frame in ("shoe", "rod"):
            for roll in (0, 0.8, np.pi / 2):
                np.testing.assert_allclose(self.ends(four_bar(roll, frame=frame)), upright, atol=1e-8, err_msg=f"{frame} {roll}")

    def test_their_derivative(self):
        """Slope one, along a direction that tumbles the body."""
        robot = four_bar(np.pi / 2, frame="rod")
        run = robot.simulate(robot.nominal.x, DURATION, **OPTIONS)
        B = run.derivative(tolerance=1e-10)
        self.assertTrue(B.status.ok, B.status)
        w = np.array(B.project(np.random.default_rng(1).normal(size=2 * robot.dof)))
        b, errors = B(w), []
        for alpha in (1e-4, 1e-5):
            start = robot.perturb(robot.nominal.x, alpha * w)
            beside = robot.simulate(start, DURATION, gap_tolerance=1e-6, speed_tolerance=1e-3, **OPTIONS)
            errors.append(np.linalg.norm(robot.separation(beside.final_state, run.final_state) / alpha - b))
        self.assertLess(errors[1], 1e-3 * np.linalg.norm(b))
        self.assertLess(errors[1], 0.2 * errors[0])

    def test_axes_of_the_world_that_have_turned_away(self):
        """They are refused at the start, and where a run comes there, with the closure's name."""
        robot = four_bar(np.pi / 2)
        with self.assertRaisesRegex(ValueError, "'loop_z' depends on those before it"):
            robot.simulate(robot.nominal.x, DURATION)
        robot = four_bar(1.5)
        x = robot.nominal.x.copy()
        x[robot.num_positions + robot.velocities.index("base_wx")] = 1.0
        run = robot.simulate(x, DURATION, max_seconds=60)
        self.assertEqual("non-finite", run.status.outcome)
        self.assertRegex(run.status.message, "'loop_[xz]' depends on those before it.*`frame`")
        roll = np.arctan2(run.final_state[4], run.final_state[3]) * 2
        self.assertAlmostEqual(np.pi / 2, roll, delta=1e-3)

    def test_bars_in_one_line(self):
        """There the loop may fold, and goes on in one of two ways: whatever the tolerance, a run ends there and says so. At
        1e-12 it changed to the other way before."""
        for tolerance in (1e-6, 1e-9, 1e-12):
            robot = four_bar(0, frame="rod", stop=9.0)
            run = robot.simulate(robot.nominal.x, 1.5, relative_tolerance=tolerance, absolute_tolerance=tolerance)
            self.assertEqual("non-finite", run.status.outcome, tolerance)
            self.assertRegex(run.status.message, "'loop_[xz]' depends on those before it")
            self.assertAlmostEqual(np.pi / 2, of_joints(robot, run.final_state)[0], delta=2e-3)

    def test_one_row_that_vanishes(self):
        """A bar that hangs, with a shorter one up: its tip goes along a line whose row is zero there, and may go on in two ways,
        θ and φ from these with φ² = 2 θ². A row alone depends on no other."""
        urdf = ('<robot name="r"><link name="base"/>' + link("long", 1, -0.2) + link("short", 1, -0.1) +
                hinge("a", "base", "long", "0 0 0") + hinge("b", "long", "short", "0 0 -0.4") + "</robot>")
        a = 0.5
        turn = np.arccos((0.2 - 0.4 * np.cos(a)) / 0.2)  # of the short one: 0.4 cos a + 0.2 cos(a + b) = 0.2
        robot = cf.Robot.from_strings(urdf, json.dumps({
            "base": "fixed", "gravity": 0, "nominal": {
                "positions": {"a": a, "b": turn - a}, "velocities": {"a": -1.0, "b": 1 + 2 * np.sin(a) / np.sin(turn)}},
            "closures": {"tip": {"link": "short", "point": [0, 0, -0.2], "other_link": "base", "other_point": [0, 0, -0.2],
                                 "axes": "z"}}}))
        x = robot.project(robot.nominal.x)
        run = robot.simulate(x, 2.0, relative_tolerance=1e-10, absolute_tolerance=1e-10)
        self.assertEqual("non-finite", run.status.outcome)
        self.assertRegex(run.status.message, "'tip_z' depends on those before it there, or has vanished")
        self.assertAlmostEqual(0, run.final_state[0], delta=2e-3)

    def test_a_start_that_nearly_closes(self):
        """Angles of two digits are refused, and moved onto the loop."""
        robot = four_bar(0.4, frame="rod")
        x = robot.perturb(robot.nominal.x, 1e-2 * np.random.default_rng(2).normal(size=2 * robot.dof))
        with self.assertRaisesRegex(ValueError, "'loop_x' is .*does not meet it"):
            robot.simulate(x, 0.1)
        y = robot.project(x)
        gap, rows, _ = robot.constraint_terms(y[:robot.num_positions], y[robot.num_positions:])
        np.testing.assert_allclose(gap[1:], 0, atol=1e-13)
        np.testing.assert_allclose(rows[1:] @ y[robot.num_positions:], 0, atol=1e-13)
        self.assertLess(np.linalg.norm(robot.separation(y, x)), 0.1)
        self.assertTrue(robot.simulate(y, 0.1).status.ok)
        y = x.copy()
        y[list(robot.state_names).index("bar")] = np.nan
        with self.assertRaisesRegex(ValueError, "not finite"):
            robot.project(y)

    def test_a_frame_that_is_none(self):
        """It is refused with what it may be."""
        with self.assertRaisesRegex(ValueError, "closures/loop/frame is 'body', expected world, or one of its links: 'shoe', 'rod'"):
            four_bar(0, frame="body")


if __name__ == "__main__":
    case.main()
