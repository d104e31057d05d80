#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fig. 4 of the paper from running nodes: what the return map does to a ball around the trot, wide and narrow.

Two trots that differ in their stance. The derivative of each return map is linear on two cones, the left or the right
foot landing first; the unit ball is mapped by one and the other. Asks for derivatives, verdicts on stability with
certificates, and simulated returns from beside the orbit; records, verifies, then draws from the bags. Private parameters:
  ~points  simulated returns around the ball (24)
  ~range   how far from the orbit they start: pitch [rad] and pitch rate [rad/s] (0.001)
The nodes are the relative names wide and narrow.
"""
import os
import sys

import numpy
import rospy
from contact_flow.msg import InitialState, PoincareRequest, ReturnSection

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from figure_client import Node, record_and_draw, run  # noqa: E402

APEX = ReturnSection(kind="apex", name="body_z")
FEET = ["body_x", "left_foot_x", "right_foot_x"]


def ask(node, points, size):
    """Everything the figure shows; returns the number of results."""
    node.poincare_map(section=APEX, translation=FEET)
    node.assess_stability(return_map=PoincareRequest(section=APEX, translation=FEET))
    for angle in numpy.arange(points) * 2 * numpy.pi / points:
        node.poincare_map(section=APEX, state=InitialState(
            names=["body_pitch"], positions=[size * numpy.cos(angle)],
            velocities=[size * numpy.sin(angle)]))
    return 2 + points


def main():
    rospy.init_node("fig4")
    points = max(4, rospy.get_param("~points", 24))
    size = rospy.get_param("~range", 0.001)
    return record_and_draw("fig4", [Node("wide"), Node("narrow")],
                           lambda node: ask(node, points, size))


if __name__ == "__main__":
    run(main, "fig4")
