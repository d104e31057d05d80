#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Robots beside something that they never touch, which is far away, or fast: they move as they do alone. In each of these
something of the robot's was small beside all that there was: the slip that a contact begins with, gaps, a slip that ends."""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "adversary", "robots"))
import beside
import case
import generate
import machines
from trial import DERIVATIVE, OPTIONS, Verdict, begin

for options in (OPTIONS, DERIVATIVE):
    options["max_seconds"] = 600  # no clock decides


class Strangers(unittest.TestCase):
    """Random robots that moved otherwise beside these strangers."""

    def stand(self, draw, seed, kind, big, prefix=beside.BEHIND):
        """What is contradicted, and what is counted."""
        verdict = Verdict()
        trial = begin(draw, seed, verdict)
        self.assertIsNotNone(trial, verdict)
        beside.hold(trial, kind, big, trial.random(71), prefix)
        self.assertEqual([], verdict.contradictions)
        self.assertEqual(1, verdict.counts[f"beside {kind} right"], verdict.counts)
        return verdict.counts

    def test_a_slip_in_space_begins_as_slowly(self):
        """Not with 1e-11 of the stranger's speed: the end was 3e-6 off."""
        counts = self.stand(generate.draw, 25, "fast", 1.75e4)
        self.assertEqual(1, counts["derivative, beside fast right"])

    def test_a_slip_in_space_ends_as_soon(self):
        """At 1e-12 of the stranger's speed it was told to end too slowly for a derivative."""
        counts = self.stand(generate.draw, 35, "fast", 5.7e3)
        self.assertEqual(1, counts["derivative, beside fast right"])

    def test_gaps_are_known_as_well(self):
        """To 1e-12 of where the stranger was, events followed each other without time between them."""
        self.stand(machines.draw, 24, "far", 304)

    def meet(self, seed):
        """The stranger meets a wall with one of the robot's events."""
        verdict = Verdict()
        beside.judge(begin(generate.draw, seed, verdict))
        self.assertEqual([], verdict.contradictions)
        self.assertEqual(1, verdict.counts["derivative, beside meeting right"], verdict.counts)

    def test_a_slip_in_space_ends_as_something_else_hits(self):
        """What had been left of the slip was not taken from the tangents: 0.64 of 31 off."""
        self.meet(30)

    def test_a_contact_lets_go_behind_a_slow_hit(self):
        """The word behind the hit, whose instant is known to 1e-9 s, left it out, which the derivative did not see: 7e-5 of 49."""
        self.meet(273)


if __name__ == "__main__":
    case.main()
