#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A controller in lockstep with the simulation, at 2 kHz: look at the state, decide, go on by half a millisecond.

It holds a double pendulum at angles of its own; with a robot's YAML as argument it plays with the inputs of that
robot, to see how fast the loop is.
"""
# Prints: 4000 steps to t = 2 s, 0.300, -0.200
import sys
import time
from typing import Any

import numpy as np

import contact_flow as cf

robot = len(sys.argv) > 1
system: cf.System = cf.Robot(sys.argv[1]) if robot else cf.Model("double_pendulum")
nominal = np.array(system.nominal.u)


def control(x: "np.ndarray[Any, np.dtype[np.float64]]") -> "np.ndarray[Any, np.dtype[np.float64]]":
    if robot:
        return np.asarray(nominal + 1e-3 * np.sin(x[0]))
    return np.asarray(-40 * (x[:2] - np.array([0.3, -0.2])) - 10 * x[2:])


begin = time.perf_counter()
flow = system.online()
for k in range(1, 4001):
    flow.set_input(control(flow.x))
    while flow.advance_to(k / 2000) is not None:  # stops at each event
        pass
spent = time.perf_counter() - begin

x = flow.x
print("4000 steps to t = %.0f s, %.3f, %.3f" % (flow.now, x[0], x[1]))
print("%.0f steps a second" % (4000 / spent))
