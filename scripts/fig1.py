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
import subprocess
import sys
import time

import numpy
import roslib.packages
import rospy
from contact_flow.msg import InitialState, RowMajorMatrix
from contact_flow.srv import (
    CompareBDerivative, ComputeBDerivative, DescribeModel, SimulateTrajectory, StartRecording,
    StopRecording)

BESIDE_ZERO = 1e-6  # [rad] nearly as close to 0 as touchdowns are told apart
SERVICES = {
    "simulate": SimulateTrajectory, "b_derivative": ComputeBDerivative,
    "compare": CompareBDerivative, "describe_model": DescribeModel,
    "start_recording": StartRecording, "stop_recording": StopRecording}


class Node:
    """node.simulate(samples=1) calls that service, over a kept connection; throws if refused."""

    def __init__(self, name):
        self.proxies = {}
        for service, kind in SERVICES.items():
            rospy.wait_for_service(name + "/" + service, timeout=30)
            self.proxies[service] = rospy.ServiceProxy(name + "/" + service, kind, persistent=True)
        description = self.describe_model().description
        self.coordinates = description.coordinates
        self.nominal = numpy.array(description.nominal_q)
        self.parameters = {p.name: p.value for p in description.parameters}

    def __getattr__(self, service):
        def call(**fields):
            answer = self.proxies[service](**fields)
            if not answer.success:
                raise RuntimeError("%s: %s" % (service, answer.message))
            return answer
        return call

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


def tool(name):
    """Path of an executable of this package, in the devel or the install space."""
    found = roslib.packages.find_node("contact_flow", name)
    if not found:
        raise RuntimeError("executable %s not found: is the package built and sourced?" % name)
    return found[0]


def main():
    rospy.init_node("fig1")
    start = time.time()

    def step(text):
        print("[%5.1f s] %s" % (time.time() - start, text), flush=True)

    half = max(1, rospy.get_param("~points", 61) // 2)
    pitches = numpy.linspace(-1, 1, 2 * half + 1) * rospy.get_param("~range", 0.3)
    pitches = numpy.sort(numpy.append(pitches, [-BESIDE_ZERO, BESIDE_ZERO]))

    bags = []
    for model in ("rigid_biped", "soft_biped"):
        node = Node(model)
        node.start_recording()
        try:
            results = ask(node, pitches)
        finally:
            bags += node.stop_recording().paths
        step("%s: %d results in %s" % (model, results, bags[-1]))

    verified = subprocess.run([tool("verify_bag")] + bags, stdout=subprocess.PIPE, timeout=300,
                              universal_newlines=True)
    lines = verified.stdout.strip().split("\n")
    step("verify_bag: " + lines[-1])
    if verified.returncode != 0:
        print("\n".join(line for line in lines[:-1] if "same, bit for bit" not in line))
        return 1

    figure = os.path.join(os.path.dirname(bags[0]), "fig1.png")
    drawn = subprocess.run([sys.executable, tool("plot_fig1.py"), figure] + bags, timeout=300)
    step("figure: " + figure if drawn.returncode == 0 else "plot_fig1.py failed")
    return drawn.returncode


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (RuntimeError, rospy.ROSException, rospy.ServiceException) as error:
        sys.exit("fig1: %s" % error)
