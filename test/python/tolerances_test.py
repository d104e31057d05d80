#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A random robot at looser tolerances than those at which it is known: it ends where it does, within what is told."""
import os
import sys
import unittest

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "adversary", "robots"))
import case
import generate
from trial import OPTIONS, Verdict, begin

OPTIONS["max_seconds"] = 600  # no clock decides


class Tolerances(unittest.TestCase):
    """A foot that comes back before it has left its floor."""

    def test_what_comes_back_within_the_tolerance_hits(self):
        """At 4e-3 m/s, from a height of 2e-5 m: at a tolerance of 3e-5 it was let through, and the end was 2e-2 off."""
        trial = begin(generate.draw, 735, Verdict())
        run = trial.robot.simulate(trial.robot.nominal.x, trial.draft.duration, relative_tolerance=3e-5,
                                   absolute_tolerance=3e-5, max_seconds=600)
        self.assertEqual([arc.word for arc in trial.run.arcs], [arc.word for arc in run.arcs])
        error = np.abs(trial.robot.separation(run.final_state, trial.run.final_state))
        told = np.abs(np.asarray(run.derivative(max_seconds=600).trust.state_error))
        self.assertTrue((error <= 10 * told).all(), (error, told))


if __name__ == "__main__":
    case.main()
