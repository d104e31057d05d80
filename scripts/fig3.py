#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fig. 3 of the paper from a running node: a trot over one period, and the regions of its return map's selections.

The trot hops from apex to apex; both feet land at once, and lift off at once. Pitched or spinning at the apex, one foot
lands first: the section falls into regions, one for each selection of the return map. Asks, records, verifies,
then draws from the bag. Private parameters:
  ~points  pitches and pitch rates of the section, so many of each (15)
  ~range   largest pitch [rad], and largest pitch rate [rad/s] (0.05)
The node is the relative name hopping_trot.
"""
import os
import sys

import numpy
import rospy
from contact_flow.msg import InitialState, ReturnSection

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from figure_client import Node, record_and_draw, run  # noqa: E402

APEX = ReturnSection(kind="apex", name="body_z")
FEET = ["body_x", "left_foot_x", "right_foot_x"]
SAMPLES = 240  # of the period that is drawn


def ask(node, values):
    """Everything the figure shows; returns the number of results."""
    period = node.poincare_map(section=APEX, translation=FEET).result.time
    node.simulate(duration=period, samples=SAMPLES)
    for pitch in values:
        for rate in values:
            node.simulate(duration=period, samples=1, state=InitialState(
                names=["body_pitch"], positions=[pitch], velocities=[rate]))
    return 2 + len(values) ** 2


def main():
    rospy.init_node("fig3")
    points = max(3, rospy.get_param("~points", 15))
    values = numpy.linspace(-1, 1, points) * rospy.get_param("~range", 0.05)
    return record_and_draw("fig3", [Node("hopping_trot")], lambda node: ask(node, values))


if __name__ == "__main__":
    run(main, "fig3")
