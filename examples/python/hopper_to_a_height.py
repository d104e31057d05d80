#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
#
# A leg on a rail drops, and is to be at the apex of a hop, at 0.62 m, half a second later: setpoints
# of its two servos that are led linearly and move as little as they can, through the landing.
#
#   hopper_to_a_height.py                           prints
#   hopper_to_a_height.py hopper_to_a_height.png    and draws it
#
# Prints: smooth minimum, apex at 0.6200 m

import pathlib
import sys

import numpy as np

import contact_flow as cf

ROBOTS = pathlib.Path(__file__).resolve().parents[2] / "config" / "robots"
COUNT, DURATION, HEIGHT = 10, 0.5, 0.62
robot = cf.Robot(ROBOTS / "monoped.yaml")
t = np.arange(COUNT) * DURATION / COUNT
stand = np.asarray(robot.nominal.u)
# The search begins with a knee that bends and stretches, the hip half as much.
knee = np.array([0, 0, 0.1, 0.25, 0.1, -0.6, -0.3, 0.1, 0.2, 0.2])
start = stand + np.column_stack([-0.5 * knee, knee])
found = robot.optimize_trajectory(
    cf.Grid(t, start), x0={"height": 0.5}, duration=DURATION, linear_inputs=True, effort=[1, 1], input_reference=stand,
    lower=[-1.2, 0.1], upper=[0.4, 2],
    conditions=[{"name": "height", "value": HEIGHT}, {"name": "d/dt height", "value": 0}], condition_tolerance=1e-6)
assert found.input_end is not None
setpoints = np.vstack([found.inputs.u, found.input_end])
run = found.run()
print("%s, apex at %.4f m, cost %.6f, %d runs" % (found.verdict, run.final_state[0], found.cost, found.simulations))
for event in run.events:
    if event.activated or event.released:
        print("  %.4f s:" % event.t, "lands" if event.activated else "leaves")


def draw(file: str) -> None:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, (legs, inputs) = plt.subplots(1, 2, figsize=(9, 3.4), constrained_layout=True)
    times = np.linspace(0, DURATION, 11)
    for time, q in zip(times, run.x(times)[:, :robot.num_positions]):
        at = robot.link_positions(q)[[robot.links.index(name) for name in ("body", "thigh", "shank", "foot")]]
        legs.plot(time + 0.15 * at[1:, 0], at[1:, 2], "C0")
        legs.plot(time, at[0, 2], "ks")
    legs.axhline(HEIGHT, color="C3", linestyle=":")
    legs.axhline(0, color="0.6")
    legs.set(xlabel="t [s]", ylabel="z [m]")
    for k, name in enumerate(("hip", "knee")):
        line, = inputs.plot(np.append(t, DURATION), setpoints[:, k], "o-", label=name)
        inputs.plot(t, start[:, k], ":", color=line.get_color())
    inputs.set(xlabel="t [s]", ylabel="setpoint [rad]")
    inputs.legend()
    figure.savefig(file, dpi=90)


if len(sys.argv) > 1:
    draw(sys.argv[1])
