#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A box that slides to rest in the plane, and stops just as a mass lands: derivatives beside quotients of runs."""
import json
import unittest

import numpy as np

import case
import contact_flow as cf

OPTIONS = dict(relative_tolerance=1e-12, absolute_tolerance=1e-12)
DURATION = 0.8  # [s]


def link(name, mass):
    return (f'<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>')


def joint(name, parent, child, axis):
    return (f'<joint name="{name}" type="prismatic"><parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
            '<limit lower="-99" upper="99" effort="9" velocity="9"/></joint>')


def box(under, axis):
    """A box on the ground, beside a mass that falls along `axis` onto a stop of the link `under`."""
    urdf = ('<robot name="r"><link name="ground"/>' + link("along", 1) + link("across", 1) + link("box", 2) + link("mass", 1) +
            joint("x", "ground", "along", "1 0 0") + joint("y", "along", "across", "0 1 0") +
            joint("z", "across", "box", "0 0 1") + joint("fall", under, "mass", axis) + "</robot>")
    return cf.Robot.from_strings(urdf, json.dumps({
        "base": "fixed", "nominal": {"velocities": {"x": 1.0, "y": -0.6}},
        "efforts": {"spring": {"kind": "joint_spring", "joint": "y", "stiffness": 3.0, "damping": 0.1, "rest": 0.2}},
        "constraints": {"foot": {"kind": "plane", "link": "box", "point": [0, 0, 0], "friction": 0.6},
                        "stop": {"kind": "lower_limit", "joint": "fall", "lower": 0.0}}}))


def meeting(robot):
    """The start whose mass lands as the box stops, which the height does not change."""
    x, fall = robot.nominal.x.copy(), robot.state_names.index("fall")
    x[fall] = 9.0
    far = robot.simulate(x, DURATION, **OPTIONS)
    stops = next(event.t for event in far.events if event.word_before[0] == "l" and event.word_after[0] == "s")
    x[fall] -= far.x(stops)[fall]
    for _ in range(3):
        lands = next(e for e in robot.simulate(x, DURATION, **OPTIONS).events if "stop" in e.activated)
        x[fall] += lands.x_minus[robot.num_positions + robot.velocities.index("fall")] * (lands.t - stops)
    return x


class SlipEnds(unittest.TestCase):
    """Its order with the landing decides nothing where the impact leaves it alone, or holds it."""

    def agrees(self, robot):
        """Quotients come to the derivative with slope one."""
        x, rng = meeting(robot), np.random.default_rng(3)
        run = robot.simulate(x, DURATION, **OPTIONS)
        B = run.derivative(tolerance=1e-11)
        self.assertTrue(B.status.ok, B.status)
        for _ in range(6):
            w = rng.normal(size=2 * robot.dof)
            w[robot.velocities.index("z")] = w[robot.dof + robot.velocities.index("z")] = 0
            w /= np.linalg.norm(w)
            coarse, fine = (np.linalg.norm(robot.separation(
                robot.simulate(robot.perturb(x, a * w), DURATION, **OPTIONS).final_state, run.final_state) / a - B(w))
                for a in (1e-3, 1e-5))
            self.assertLess(coarse, 1e-2)
            self.assertLess(fine, 0.02 * coarse + 1e-6)

    def test_beside_it(self):
        self.agrees(box("ground", "0 0 1"))

    def test_on_top_of_it(self):
        self.agrees(box("box", "0 0 1"))

    def test_an_impact_that_makes_it_slip_anew_is_refused(self):
        """From what is left of the slip, or from rest: quotients of the two orders were 2e-2 apart."""
        robot = box("box", "-0.7 0.2 0.7")
        run = robot.simulate(meeting(robot), DURATION, **OPTIONS)
        status = run.derivative().status
        self.assertEqual("not differentiable", status.outcome)
        self.assertIn("slip anew", status.message)


if __name__ == "__main__":
    case.main()
