#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A random robot in other units of time: it moves as in seconds, and so do its tangents."""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "adversary", "robots"))
import case
import generate
import units
from trial import DERIVATIVE, OPTIONS, Verdict, begin
from units import Units

for options in (OPTIONS, DERIVATIVE):
    options["max_seconds"] = 600  # no clock decides


class OtherUnits(unittest.TestCase):
    """A random robot that had another derivative in these units."""

    def test_a_slip_in_space_begins_with_implicit_steps(self):
        """Where it is slow beside velocities, whatever the tolerance: the derivative was 3e-4 off, told as 6e-7."""
        verdict = Verdict()
        trial = begin(generate.draw, 83, verdict)
        self.assertIsNotNone(trial, verdict)
        units.hold(trial, Units(1, 1, 0.125), 1.25e-13)
        self.assertEqual([], verdict.contradictions)
        self.assertEqual(1, verdict.counts["units right"], verdict.counts)
        self.assertEqual(1, verdict.counts["derivative, units right"], verdict.counts)


if __name__ == "__main__":
    case.main()
