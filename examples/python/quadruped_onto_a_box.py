#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
#
# A quadruped jumps onto a box of 0.2 m and is to be there, still, after 0.96 s: setpoints of its
# servos, through take-off, landings on the box and slips of its feet, with friction. In the plane:
# the legs of a pair move as one.
#
#   quadruped_onto_a_box.py                             prints
#   quadruped_onto_a_box.py quadruped_onto_a_box.png    and draws it
#
# Prints: lands on: rear_on_box front_on_box

import pathlib
import sys
from typing import Any

import numpy as np

import contact_flow as cf

COUNT, DURATION = 12, 0.96
robot = cf.Robot(pathlib.Path(__file__).resolve().parents[1] / "robots" / "quadruped_jump.yaml")
t = np.arange(COUNT) * DURATION / COUNT
stand = np.array([0.7, -1.4, 0.7, -1.4])
# A jump by trial, whose rear feet come down before the box: front pitch and knee, rear pitch and knee at some instants.
keys = [0, 0.04, 0.09, 0.21, 0.33, 0.55, 0.75, DURATION]
setpoints = np.array([[1, -2, 1, -2], [1, -2, 1, -2], [1.25, -0.2, 0.98, -0.38], [1.1, -2.3, 0.98, -0.68],
                      [1.1, -2.3, 0.79, -2.3], [-0.14, -1.6, 1.2, -1.6], stand, stand])
start = np.column_stack([np.interp(np.append(t, DURATION), keys, column) for column in setpoints.T])
goal = {"base_x": 0.62, "base_z": 0.5, "base_pitch": 0, "d/dt base_x": 0, "d/dt base_z": 0, "d/dt base_pitch": 0}
weight = {"base_x": 100, "base_z": 200, "base_pitch": 50, "d/dt base_x": 5, "d/dt base_z": 5, "d/dt base_pitch": 2}


def search(iterations: int) -> cf.OptimalTrajectory:
    return robot.optimize_trajectory(
        cf.Grid(t, start[:-1]), goal, weight, duration=DURATION, linear_inputs=True, input_end=start[-1],
        effort=[0.5] * 4, input_reference=stand, max_iterations=iterations)


first, found = search(0).run(), search(5)
run = found.run()
print("cost %.3f after %d steps, begun with %.3f" % (found.cost, len(found.iterations) - 1, found.iterations[0][1]))
landed = dict.fromkeys(name for event in run.events for name in event.activated if name.endswith("_box"))
print("lands on:", " ".join(landed))


def draw(file: str) -> None:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.patches import Rectangle
    figure, panels = plt.subplots(1, 2, figsize=(9, 3), sharey=True, constrained_layout=True)
    for axis, (title, which) in zip(panels, (("by trial", first), ("found", run))):
        states: Any = which.x(np.linspace(0, DURATION, 9))
        for k, q in enumerate(states[:, :robot.num_positions]):
            at, shade = robot.link_positions(q), 0.2 + 0.1 * k
            for link, parent in enumerate(robot.link_parents):
                if parent >= 0:
                    colour = "C3" if robot.links[link].startswith("front") else "C0"
                    axis.plot(at[[parent, link], 0], at[[parent, link], 2], colour, alpha=shade)
            ends = at[0, [0, 2]] + np.outer([-0.25, 0.25], [np.cos(q[2]), -np.sin(q[2])])
            axis.plot(ends[:, 0], ends[:, 1], "k", lw=3, alpha=shade)
        axis.add_patch(Rectangle((0.3, 0), 0.7, 0.2, color="0.7"))
        axis.axhspan(-0.1, 0, color="0.85")
        axis.set(title=title, xlabel="x [m]", xlim=(-0.5, 1.2), ylim=(-0.05, 0.9), aspect="equal")
    panels[0].set_ylabel("z [m]")
    figure.savefig(file, dpi=90)


if len(sys.argv) > 1:
    draw(sys.argv[1])
