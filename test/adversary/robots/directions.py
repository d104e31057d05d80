# SPDX-License-Identifier: BSD-3-Clause
"""Directions of a derivative beside one-sided quotients, and the chain rule."""
from typing import Any

import numpy as np

from trial import DERIVATIVE, OPTIONS, Trial, error_of, hold_against_quotients, unit


def try_direction(trial: Trial, w: np.ndarray) -> None:
    """One direction beside quotients."""
    robot, B, verdict = trial.robot, trial.derivative, trial.verdict
    try:
        b = B(w)
        stated = float(np.linalg.norm(error_of(B, w)))
        radius = float(B.radius(w))
    except (ValueError, RuntimeError):
        verdict.counts["direction refused"] += 1
        return

    def quotient(alpha: float) -> Any:
        run = robot.simulate(robot.perturb(robot.nominal.x, alpha * w), trial.draft.duration, **OPTIONS)
        return robot.separation(run.final_state, trial.run.final_state) / alpha if run.status.ok else None

    hold_against_quotients(verdict, "direction", b, stated, radius, quotient)


def try_chain(trial: Trial, rng: np.random.Generator) -> None:
    """B of the whole beside B of two halves, where neither has kinks."""
    robot, B, duration = trial.robot, trial.derivative, trial.draft.duration
    at = duration * float(rng.uniform(0.2, 0.8))
    if any(abs(event.t - at) < 1e-4 for event in trial.run.events):
        return
    first = robot.simulate(robot.nominal.x, at, **OPTIONS)
    second = robot.simulate(first.final_state, duration - at, **OPTIONS)
    if not (first.status.ok and second.status.ok) or second.arcs[0].word != first.arcs[-1].word:
        return
    before, after = first.derivative(**DERIVATIVE), second.derivative(**DERIVATIVE)
    if not (before.status.ok and after.status.ok):
        return
    try:
        w = rng.normal(size=2 * robot.dof)
        whole, parts = B(w), after(after.project(before(w)))
    except (ValueError, RuntimeError):
        return
    error = float(np.linalg.norm(whole - parts)) / (1 + float(np.linalg.norm(whole)))
    stated = float(np.linalg.norm(error_of(B, w))) / (1 + float(np.linalg.norm(whole)))
    trial.verdict.weigh("chain", error <= 1e-6 + 3 * stated, f"at {at} off by {error:.2e}, stated {stated:.1e}")


def judge(trial: Trial) -> None:
    """One coordinate and two random tangents, forth and back."""
    if trial.derivative is None:
        return
    rng, robot = trial.random(1), trial.robot
    for k in range(3):
        w = trial.direction(rng) if k else unit(robot, np.eye(2 * robot.dof)[int(rng.integers(robot.dof))])
        for sign in (1, -1):
            try_direction(trial, sign * w)
    try_chain(trial, rng)
