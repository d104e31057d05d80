# SPDX-License-Identifier: BSD-3-Clause
"""The whole piecewise-linear map of a derivative beside its single directions, and the contact modes that it tells of perturbed
runs beside those runs."""
import numpy as np

from trial import DERIVATIVE, OPTIONS, Trial, error_of

STEPS = [1e-4, 1e-5, 1e-6, 1e-7]  # along a direction
DIRECTIONS = 3


def judge(trial: Trial) -> None:
    """The map is continuous and is B along random directions; the modes are those of a run a little along them."""
    B, robot, verdict = trial.derivative, trial.robot, trial.verdict
    if B is None:
        return
    rng = trial.random(67)
    try:
        whole = B.pieces(max_seconds=DERIVATIVE["max_seconds"])
    except (ValueError, RuntimeError):
        whole = None
        verdict.counts["no map of pieces"] += 1
    if whole is not None:
        verdict.weigh("map", whole.consistency().ok or whole.consistency().size < 1e-6, whole.consistency().message)
    for _ in range(DIRECTIONS):
        w = trial.direction(rng)
        try:
            b, stated = B(w), float(np.linalg.norm(error_of(B, w)))
            radius = float(B.radius(w))
        except (ValueError, RuntimeError):
            continue
        if whole is not None:
            apart = float(np.linalg.norm(whole(w) - b))
            verdict.weigh("piece", apart <= 1e-7 * (1 + float(np.linalg.norm(b))) + 3 * stated, f"{apart:.2e} apart of {len(whole)}")
        if any(warning.code == "zeno" for warning in trial.run.warnings):  # bounces that a run takes to rest
            continue
        told, found = [sorted(mode) for mode in B.perturbed_modes(w)], []
        for alpha in (alpha for alpha in STEPS if alpha <= 0.03 * radius):  # events that are nearer than they are known merge
            run = robot.simulate(robot.perturb(robot.nominal.x, alpha * w), trial.draft.duration, **OPTIONS)
            if run.status.ok:
                found.append([sorted(mode) for mode in run.modes])
        if found:
            verdict.weigh("modes", told in found, f"{told} told, {found} found")
