#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fig. 1 of the paper from two running nodes: asks, records, verifies, then draws from the bags.

Both models are dropped with pitch θ(0), everything rotated with the body; the outcome is θ(T).
Started by scripts/demo and launch/fig1.launch. Private parameters:
  ~points  number of initial pitches (61), made odd so that 0 is one of them
  ~range   largest initial pitch [rad] (0.3)
The nodes are the relative names rigid_biped and soft_biped.
"""
import os
import sys

import numpy
import rospy
from contact_flow.msg import InitialState, RowMajorMatrix

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from figure_client import Node, record_and_draw, run  # noqa: E402

BESIDE_ZERO = 1e-6  # [rad] nearly as close to 0 as touchdowns are told apart


class Biped(Node):
    """A node whose model has a body on two feet."""

    def configuration(self, pitch):
        """q [d]: the nominal one, rotated about the body's centre. Soft legs stay at rest."""
        q = self.nominal.copy()
        i = self.coordinates.index
        q[i("body_pitch")] = pitch
        length, hip = self.parameters["leg_length"], self.parameters["hip_offset"]
        for foot, offset in (("left_foot", -hip), ("right_foot", hip)):
            if foot + "_x" in self.coordinates:
                q[i(foot + "_x")] += rotated(pitch, offset, -length)[0] - offset
                q[i(foot + "_z")] += rotated(pitch, offset, -length)[1] + length
        return q

    def tangent(self):
        """δx(0) [2d] of that family at pitch 0, by its derivative in closed form."""
        w = numpy.zeros(2 * len(self.coordinates))
        i = self.coordinates.index
        w[i("body_pitch")] = 1
        length, hip = self.parameters["leg_length"], self.parameters["hip_offset"]
        for foot, offset in (("left_foot", -hip), ("right_foot", hip)):
            if foot + "_x" in self.coordinates:
                w[i(foot + "_x")], w[i(foot + "_z")] = length, offset
        return w


def rotated(angle, x, z):
    c, s = numpy.cos(angle), numpy.sin(angle)
    return c * x - s * z, s * x + c * z


def ask(node, pitches):
    """Everything the figure shows of one model; returns the number of results."""
    for pitch in pitches:
        node.simulate(state=InitialState(q=node.configuration(pitch)), samples=1)
    w = node.tangent()
    both = RowMajorMatrix(rows=2, cols=w.size, data=numpy.concatenate([w, -w]))
    derivative = node.b_derivative(direction_matrix=both, all_pieces=True)
    if derivative.outcome == derivative.OK:
        node.compare(direction_matrix=both)
        return len(pitches) + 2
    # Discontinuous. What either order of the touchdowns leads to is the limit from one side.
    modes = derivative.derivative.modes
    landing = node.simulate(samples=1).trajectory.transitions[0]
    for order in derivative.derivative.orders:
        node.simulate(state=InitialState(q=landing.q, v=order.v_after), samples=1,
                      duration=modes[-1].t_end - order.t)
    return len(pitches) + 2 + len(derivative.derivative.orders)


def main():
    rospy.init_node("fig1")
    half = max(1, rospy.get_param("~points", 61) // 2)
    pitches = numpy.linspace(-1, 1, 2 * half + 1) * rospy.get_param("~range", 0.3)
    pitches = numpy.sort(numpy.append(pitches, [-BESIDE_ZERO, BESIDE_ZERO]))
    bipeds = [Biped("rigid_biped"), Biped("soft_biped")]
    return record_and_draw("fig1", bipeds, lambda biped: ask(biped, pitches))


if __name__ == "__main__":
    run(main, "fig1")
