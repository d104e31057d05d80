#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Friction from running nodes: a block that sticks and slips, and a compass walker's limit cycle with its eigenvalues.

Asks for a run of the block, for the walker's return map from heel strike to heel strike with its verdict on stability,
and for a run from beside its gait; records, verifies, then draws from the bags. Private parameters:
  ~duration  of the block's motion [s] (4)
  ~steps     of the walker, from beside its gait (12)
The nodes are the relative names block and walker.
"""
import os
import sys

import rospy
from contact_flow.msg import InitialState, PoincareRequest, ReturnSection

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from figure_client import Node, record_and_draw, run  # noqa: E402

STEP = ReturnSection(kind="touchdown", name="right_foot", exchange=["left_leg", "right_leg"],
                     travel=["hip_x"])
PERIOD = 0.734346391  # [s] of the gait
FASTER = 1.03         # than the gait


def ask(node, duration, steps):
    """Everything the figure shows; returns the number of results."""
    description = node.describe_model().description
    if description.name == "block_on_incline":
        node.simulate(duration=duration, samples=1000, state=InitialState(v=[0.0, 0.0, 1.0]))
        return 1
    node.poincare_map(section=STEP)
    node.assess_stability(return_map=PoincareRequest(section=STEP))
    v = [FASTER * rate for rate in description.nominal_v]
    node.simulate(duration=steps * PERIOD, samples=100 * steps, state=InitialState(v=v))
    return 3


def main():
    rospy.init_node("fig5")
    duration = rospy.get_param("~duration", 4.0)
    steps = max(1, rospy.get_param("~steps", 12))
    return record_and_draw("fig5", [Node("block"), Node("walker")],
                           lambda node: ask(node, duration, steps))


if __name__ == "__main__":
    run(main, "fig5")
