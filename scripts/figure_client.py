#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What fig1.py to fig4.py share: a node's services as functions, verified bags, a drawn figure."""
import os
import subprocess
import sys
import time

import numpy
import roslib.packages
import rospy
from contact_flow.srv import (
    CompareBDerivative, ComputeBDerivative, ComputePoincareMap, DecideStability, DescribeModel,
    SimulateTrajectory, StartRecording, StopRecording)

SERVICES = {
    "simulate": SimulateTrajectory, "b_derivative": ComputeBDerivative,
    "compare": CompareBDerivative, "describe_model": DescribeModel,
    "poincare_map": ComputePoincareMap, "assess_stability": DecideStability,
    "start_recording": StartRecording, "stop_recording": StopRecording}


class Node:
    """node.simulate(samples=1) calls that service, over a kept connection; throws if refused."""

    def __init__(self, name):
        self.name = name
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


def tool(name):
    """Path of an executable of this package, in the devel or the install space."""
    found = roslib.packages.find_node("contact_flow", name)
    if not found:
        raise RuntimeError("executable %s not found: is the package built and sourced?" % name)
    return found[0]


def record_and_draw(figure, nodes, ask):
    """Has each node record what ask(node) asks it, which returns the number of results; verifies
    the bags and draws `figure`.png from them. Returns the exit status."""
    start = time.time()

    def step(text):
        print("[%5.1f s] %s" % (time.time() - start, text), flush=True)

    bags = []
    for node in nodes:
        node.start_recording()
        try:
            results = ask(node)
        finally:
            bags += node.stop_recording().paths
        step("%s: %d results in %s" % (node.name, results, bags[-1]))

    verified = subprocess.run([tool("verify_bag")] + bags, stdout=subprocess.PIPE, timeout=300,
                              universal_newlines=True)
    lines = verified.stdout.strip().split("\n")
    step("verify_bag: " + lines[-1])
    if verified.returncode != 0:
        print("\n".join(line for line in lines[:-1] if "same, bit for bit" not in line))
        return 1

    picture = os.path.join(os.path.dirname(bags[0]), figure + ".png")
    plot = "plot_%s.py" % figure
    drawn = subprocess.run([sys.executable, tool(plot), picture] + bags, timeout=300)
    step("figure: " + picture if drawn.returncode == 0 else plot + " failed")
    return drawn.returncode


def run(main, name):
    """The exit of a client: failures of requests are a sentence, not a traceback."""
    try:
        sys.exit(main())
    except (RuntimeError, rospy.ROSException, rospy.ServiceException) as error:
        sys.exit("%s: %s" % (name, error))
