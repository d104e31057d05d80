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


if __name__ == "__main__":
    case.main()
