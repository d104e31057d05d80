#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
#
# A ball falls from 4 m and is to rest at 1 m after 1.004 s, having bounced: 251 inputs of 4 ms. The
# least cost is on a kink, the bounce falling on a change of the input; it is shown by what the cost
# is where the bounce is moved to the changes beside.
#
#   ball_to_a_goal.py                       prints
#   ball_to_a_goal.py ball_to_a_goal.png    and draws it
#
# Prints: valley, cost 2.1422168

import sys

import numpy as np

import contact_flow as cf

COUNT, STEP = 251, 0.004
t = STEP * np.arange(COUNT)
ball = cf.Model("driven_ball")
goal, weight = {"z": 1, "d/dt z": 0}, {"z": 100, "d/dt z": 100}


def search(neighbours: bool) -> cf.OptimalTrajectory:
    return ball.optimize_trajectory(cf.Grid(t, np.full((COUNT, 1), -20.0)), goal, weight, effort=[5e-7 / STEP ** 2],
                                    duration=COUNT * STEP, neighbours=neighbours)


plain, found = search(False), search(True)
for name, which in (("descent", plain), ("neighbours", found)):
    print("%s: %s, cost %.9f, %d runs" % (name, which.verdict, which.cost, which.simulations))
for piece in found.certificate:
    print("  %s: the cost rises by %.3f for each second" % (piece["label"], piece["slopes"][0][3]))


def draw(file: str) -> None:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, (heights, inputs) = plt.subplots(1, 2, figsize=(9, 3.2), constrained_layout=True)
    times = np.linspace(0, COUNT * STEP, 500)
    for name, which in (("descent: %.4f" % plain.cost, plain), ("neighbours: %.4f" % found.cost, found)):
        heights.plot(times, which.run().x(times)[:, 0], label=name)
        inputs.step(t, which.inputs.u, where="post", label=name)
    heights.plot([COUNT * STEP], [1], "k*", label="goal")
    heights.set(xlabel="t [s]", ylabel="height [m]")
    inputs.set(xlabel="t [s]", ylabel="force [N]")
    heights.legend()
    figure.savefig(file, dpi=90)


if len(sys.argv) > 1:
    draw(sys.argv[1])
