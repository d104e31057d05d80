# SPDX-License-Identifier: BSD-3-Clause
"""The gradient of a cost at the end and along the way, by transposed pieces, beside quotients of costs."""
from typing import Any, Dict

import numpy as np

from trial import OPTIONS, Trial, error_of, hold_against_quotients


def draw_cost(trial: Trial, rng: np.random.Generator) -> Dict[str, Any]:
    """Targets and weights of some coordinates and velocities."""
    names = [name for name in trial.robot.state_names if "clock" not in name and not name.startswith("base_q")]
    cost: Dict[str, Any] = {}
    for prefix, count in (("", 3), ("path_", 2)):
        chosen = [str(name) for name in rng.choice(names, min(count, len(names)), replace=False)]
        cost[f"{prefix}target"] = {name: float(rng.normal()) for name in chosen}
        cost[f"{prefix}weight"] = {name: float(rng.uniform(0.5, 2)) for name in chosen}
    return cost


def judge(trial: Trial) -> None:
    """One direction, with the gradient of its piece."""
    robot, verdict, rng = trial.robot, trial.verdict, trial.random(34)
    if trial.derivative is None:
        return
    cost, w = draw_cost(trial, rng), trial.direction(rng)
    try:
        gradient, radius = trial.run.gradient(direction=w, **cost), float(trial.derivative.radius(w))
    except (ValueError, RuntimeError):
        verdict.counts["cost refused"] += 1
        return
    if not gradient:
        verdict.counts[f"cost: {gradient.status.outcome}"] += 1
        return

    def quotient(alpha: float) -> Any:
        run = robot.simulate(robot.perturb(robot.nominal.x, alpha * w), trial.draft.duration, **OPTIONS)
        beside = run.gradient(direction=w, **cost) if run.status.ok else None
        return np.array([beside.cost - gradient.cost]) / alpha if beside else None

    stated = float(np.linalg.norm(error_of(trial.derivative, w)))
    hold_against_quotients(verdict, "cost", np.array([gradient.initial @ w]), stated, radius, quotient)
