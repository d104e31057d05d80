#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fig. 2 of the paper from a running node: one contact lets go at the instant another begins.

A point slides on a floor towards a wall; a clock lifts it off the floor at the instant it hits the
wall. Setting the clock by α [s] makes it let go earlier or later than it hits: two orders of
events, one derivative. Asks, records, verifies, then draws from the bag. Private parameters:
  ~points  number of settings of the clock (61), made odd so that 0 is one of them
  ~range   largest setting [s] (0.3)
The node is the relative name wall_and_floor.
"""
import os
import sys

import numpy
import rospy
from contact_flow.msg import InitialState

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from figure_client import Node, record_and_draw, run  # noqa: E402

BESIDE_ZERO = 1e-5  # [s] beside the simultaneous events, where their order is decided
SAMPLES = 60        # of the runs that are drawn as trajectories
TRAJECTORIES = 7


def ask(node, settings):
    """Everything the figure shows; returns the number of results."""
    clock = node.coordinates.index("clock")

    def state(setting):
        q = node.nominal.copy()
        q[clock] += setting
        return InitialState(q=q)

    for setting in settings:
        node.simulate(state=state(setting), samples=1)
    drawn = numpy.linspace(settings[0], settings[-1], TRAJECTORIES)
    for setting in drawn:
        node.simulate(state=state(setting), samples=SAMPLES)
    along = ["+clock", "-clock"]
    node.b_derivative(directions=along, all_pieces=True)
    for setting in (-BESIDE_ZERO, BESIDE_ZERO):
        node.b_derivative(state=state(setting), directions=along)
    node.compare(directions=along)
    return len(settings) + len(drawn) + 4


def main():
    rospy.init_node("fig2")
    half = max(1, rospy.get_param("~points", 61) // 2)
    settings = numpy.linspace(-1, 1, 2 * half + 1) * rospy.get_param("~range", 0.3)
    return record_and_draw("fig2", [Node("wall_and_floor")], lambda node: ask(node, settings))


if __name__ == "__main__":
    run(main, "fig2")
