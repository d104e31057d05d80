#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
#
# A trot on a narrow stance, unstable by a factor of 35 a step, which lands on both feet at once: a
# torque on its body, set at each apex and held to the next, makes it stable. One gain, or one for
# each foot that may land first; from how far they bring it back, by simulation.
#
#   steady_trot.py                       prints
#   steady_trot.py feedback_basin.png    and draws the starts that come back (minutes)
#
# Prints: stable: every piece of the closed loop contracts in one quadratic norm, by 0.299866

import sys
from typing import List, Optional, Tuple

import numpy as np

import contact_flow as cf

SHIFT = ["body_x", "left_foot_x", "right_foot_x"]
trot = cf.Model("steered_trot", hip_offset=0.25)
apexes = trot.poincare(cf.Apex("body_z"))
print("without:", apexes().stability(SHIFT).message)
one_gain = apexes.feedback(translation=SHIFT)
two_gains = apexes.feedback(translation=SHIFT, piecewise=True)
for name, feedback in (("one gain", one_gain), ("two gains", two_gains)):
    print("%s:" % name, feedback.message)
    print("certificate verified:", feedback.verify())


STEPS = 30


def comes_back(law: Optional[cf.Feedback], pitch: float, rate: float, size: float) -> bool:
    """Whether steps under the law, or without a torque, bring the trot back from there."""
    x = trot.nominal.x.copy()
    x[trot.state_names.index("body_pitch")] += pitch
    x[trot.state_names.index("d/dt body_pitch")] += rate
    if law is not None:
        run = law.follow(x, STEPS, lost=5)
        return len(run.u) == STEPS and run.away[-1] < 0.01 * size
    away = 0.0
    for _ in range(STEPS):
        back = apexes(x, derivative=False)
        if not back or away > 5:
            return False
        x = back.x
        away = float(np.linalg.norm(two_gains.basis.T @ (x - trot.nominal.x)))
    return away < 0.01 * size


def draw(file: str, points: int = 15) -> None:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    panels: List[Tuple[str, Optional[cf.Feedback], float]] = [
        ("no feedback", None, 1e-3), ("one gain", one_gain, 5e-3), ("two gains", two_gains, 0.6)]
    figure, axes = plt.subplots(1, len(panels), figsize=(10, 3.6), constrained_layout=True)
    for axis, (title, law, size) in zip(axes, panels):
        ticks = np.linspace(-size, size, points)
        kept = [[comes_back(law, pitch, rate, size) for pitch in ticks] for rate in ticks]
        axis.imshow(kept, origin="lower", extent=(-size, size, -size, size), cmap="Greys",
                    vmin=0, vmax=1.3, aspect="auto")
        axis.set_title("%s: %d of %d" % (title, np.sum(kept), points ** 2))
        axis.locator_params(axis="x", nbins=5)
        axis.set_xlabel("pitch [rad]")
    axes[0].set_ylabel("pitch rate [rad/s]")
    figure.savefig(file, dpi=90)


if len(sys.argv) > 1:
    draw(sys.argv[1])
