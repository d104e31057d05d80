#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
#
# A planar biped walks into a log that lies where its right foot is to go: setpoints of its servos
# that lift the foot over it and put it down behind, through the landings of both feet with friction.
# The log is a contact of the robot, on which a swing that does not know of it ends.
#
#   biped_over_an_obstacle.py                               prints
#   biped_over_an_obstacle.py biped_over_an_obstacle.png    and draws it
#
# Prints: touches: left_foot right_foot

import pathlib
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

import contact_flow as cf

Array = NDArray[np.float64]

ROBOTS = pathlib.Path(__file__).resolve().parents[1] / "robots"
COUNT, DURATION = 8, 0.5
robot = cf.Robot(ROBOTS / "biped_obstacle.yaml")
t = np.arange(COUNT) * DURATION / COUNT
nominal = np.asarray(robot.nominal.u)


def swing(s: Array, knee: float) -> Array:
    """Hip and knee of the right leg at the part s of the step."""
    hip = 0.35 - 0.8 * np.minimum(1, 1.3 * s)
    return np.column_stack([hip, 0.5 + knee * np.sin(np.pi * s ** 1.3) ** 2 - 0.15 * s])


def touches(run: cf.Run) -> str:
    return " ".join(dict.fromkeys(name for event in run.events for name in event.activated))


s: Any = t / DURATION
stance = np.column_stack([-0.1 + 0.5 * s, np.full(COUNT, 0.2)])
first = robot.simulate(duration=DURATION, inputs=cf.Grid(t, np.hstack([stance, swing(s, 0.4)])))
print("without the search it touches:", touches(first))
# The search begins with a knee that is bent by far.
knee = 0.5 + 1.5 * np.sin(np.pi * np.minimum(1, 1.1 * s) ** 1.2) ** 2 - 0.2 * s
start = np.column_stack([stance, 0.35 - 0.95 * np.minimum(1, 1.5 * s), knee])
path = np.zeros((COUNT, robot.num_positions))
path[:, 5:] = swing((t + t[1]) / DURATION, 1.4)
goal = {"base_x": 0.31, "base_z": 0.81, "base_pitch": 0, "left_hip": 0.3, "left_knee": 0.3, "right_hip": -0.55, "right_knee": 0.55,
        "d/dt base_x": 0.6, "d/dt base_pitch": 0, "d/dt right_hip": 0, "d/dt right_knee": 0}
weight = {"base_x": 20, "base_z": 50, "base_pitch": 50, "left_hip": 5, "left_knee": 5, "right_hip": 10, "right_knee": 10,
          "d/dt base_x": 2, "d/dt base_pitch": 2, "d/dt right_hip": 0.05, "d/dt right_knee": 0.05}
found = robot.optimize_trajectory(
    cf.Grid(t, start), goal, weight, duration=DURATION, linear_inputs=True, effort=[1, 1, 1, 1],
    input_reference=nominal + [0, 0, -0.45, -0.2], path_reference=path,
    path_weight={"right_knee": 50, "right_hip": 5, "base_pitch": 20}, max_iterations=12)
run = found.run()
print("cost %.3f after %d steps, begun with %.3f" % (found.cost, len(found.iterations) - 1, found.iterations[0][1]))
print("touches:", touches(run))


def draw(file: str) -> None:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.patches import Circle
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True, constrained_layout=True)
    parents = robot.link_parents
    for axis, (title, which) in zip(panels, (("a swing", first), ("found", run))):
        times = np.linspace(0, DURATION, 11)
        states: Any = which.x(times)
        for k, q in enumerate(states[:, :robot.num_positions]):
            at = robot.link_positions(q)
            for link, parent in enumerate(parents):
                if parent < 0:
                    continue
                colour = "C3" if robot.links[link].startswith("right") else "C0"
                axis.plot(at[[parent, link], 0], at[[parent, link], 2], colour, alpha=0.25 + 0.07 * k)
            axis.plot(at[0, 0] + np.array([0, 0.4 * np.sin(q[2])]), at[0, 2] + np.array([0, 0.4 * np.cos(q[2])]),
                      "k", alpha=0.25 + 0.07 * k)
        axis.add_patch(Circle((0.15, -0.04), 0.1, color="0.5"))
        axis.axhspan(-0.15, 0, color="0.85", zorder=3)
        axis.set(title=title, xlabel="x [m]", xlim=(-0.6, 1), ylim=(-0.05, 1.3), aspect="equal")
    panels[0].set_ylabel("z [m]")
    figure.savefig(file, dpi=90)


if len(sys.argv) > 1:
    draw(sys.argv[1])
