#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Random robots in other units of time, as a robot has them that lives a few milliseconds: they move as in seconds, and so
do their tangents."""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "adversary", "robots"))
import case
import generate
import units
from trial import DERIVATIVE, OPTIONS, TOLERANCE, Verdict, begin
from units import Units

for options in (OPTIONS, DERIVATIVE):
    options["max_seconds"] = 600  # no clock decides


class OtherUnits(unittest.TestCase):
    """Random robots that moved otherwise in these units, or had other derivatives."""

    def convert(self, seed, time, tolerance=TOLERANCE):
        """What is counted of a robot in units of time; nothing is contradicted."""
        verdict = Verdict()
        trial = begin(generate.draw, seed, verdict)
        self.assertIsNotNone(trial, verdict)
        units.hold(trial, Units(1, 1, time), tolerance)
        self.assertEqual([], verdict.contradictions)
        self.assertEqual(1, verdict.counts["units right"], verdict.counts)
        return verdict.counts

    def test_a_slip_in_space_begins_with_implicit_steps(self):
        """Where it is slow beside velocities, whatever the tolerance: the derivative was 3e-4 off, told as 6e-7."""
        counts = self.convert(83, 0.125, 1.25e-13)
        self.assertEqual(1, counts["derivative, units right"])

    def test_times_are_short_beside_the_run(self):
        """Not beside a second: the run stopped where no step was small enough."""
        self.convert(25, 2.0 ** -8)


if __name__ == "__main__":
    case.main()
