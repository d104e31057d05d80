#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Random robots at looser tolerances than those at which they are known: they end where they do, within what is told."""
import os
import sys
import unittest

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "adversary", "robots"))
import case
import generate
import machines
from trial import OPTIONS, Verdict, begin

import contact_flow as cf

OPTIONS["max_seconds"] = 600  # no clock decides


class Tolerances(unittest.TestCase):
    """Where contacts come back so soon that the tolerance decides how."""

    def end(self, draw, seed, tolerance):
        """A run that ends within what is told of its errors, and the one at the strict tolerance."""
        trial = begin(draw, seed, Verdict())
        run = trial.robot.simulate(trial.robot.nominal.x, trial.draft.duration, relative_tolerance=tolerance,
                                   absolute_tolerance=tolerance, max_seconds=600)
        error = np.abs(trial.robot.separation(run.final_state, trial.run.final_state))
        told = np.abs(np.asarray(run.derivative(max_seconds=600).trust.state_error))
        self.assertTrue((error <= 10 * told).all(), (error, told))
        return run, trial.run

    def test_what_comes_back_within_the_tolerance_hits(self):
        """At 4e-3 m/s, from a height of 2e-5 m: at a tolerance of 3e-5 it was let through, and the end was 2e-2 off."""
        run, strict = self.end(generate.draw, 735, 3e-5)
        self.assertEqual([arc.word for arc in strict.arcs], [arc.word for arc in run.arcs])

    def test_what_bounces_leave_that_are_made_rest_is_told(self):
        """Two legs that rise at 5e-4 m/s, of which one has left for good: 7e-4 off, where 8e-6 was told."""
        run, strict = self.end(machines.draw, 77, 1e-6)
        self.assertNotEqual([arc.word for arc in strict.arcs], [arc.word for arc in run.arcs])
        self.assertIn("zeno", [warning.code for warning in run.warnings])

    def test_what_touches_slowly_does_not_bring_down_what_is_far_above(self):
        """Two masses on rails that share nothing. One creeps onto its stop at 41 mm/s, by e^(−t)(1 + t); the other flies
        freely, and bounces: 0.2 m off at 1e-4, as its touchdown was taken to be that of the first."""
        link = ('<link name="%s"><inertial><mass value="1"/>'
                '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>')
        rail = ('<joint name="%s" type="prismatic"><parent link="%s"/><child link="%s"/><axis xyz="%s"/>'
                '<limit lower="-9" upper="9" effort="9" velocity="9"/></joint>')
        urdf = '<robot name="r"><link name="world"/>%s</robot>' % "".join(
            link % ("car_" + a) + link % a + rail % (a + "x", "world", "car_" + a, "1 0 0")
            + rail % (a + "z", "car_" + a, a, "0 0 1") for a in "ab")
        yaml = ("{base: fixed, gravity: 0, efforts: {s: {kind: joint_spring, joint: az, stiffness: 1, damping: 2}}, "
                "constraints: {fa: {kind: plane, link: a, point: [0, 0, 0], offset: 0.05%s}, "
                "fb: {kind: plane, link: b, point: [0, 0, 0], restitution: 1%s}}}")
        touch, speed = 4.743864518, 3.0
        for friction in ("", ", friction: 0.3"):
            robot = cf.Robot.from_strings(urdf, yaml % (friction, friction))
            b = robot.state_names.index("bz")
            for tolerance in (1e-3, 1e-4, 1e-5, 1e-6):
                for gap in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1):
                    run = robot.simulate({"az": 1.0, "bz": gap + speed * touch, "d/dt bz": -speed},
                                         touch + gap / speed + 1, relative_tolerance=tolerance, absolute_tolerance=tolerance)
                    error = abs(run.final_state[b] - speed)
                    self.assertLess(error, 5 * tolerance, (friction, tolerance, gap))
                    known = run.derivative()
                    if known.status.ok:
                        told = abs(known.trust.state_error[b])
                        self.assertLess(error, 10 * told + 1e-12, (friction, tolerance, gap))


if __name__ == "__main__":
    case.main()
