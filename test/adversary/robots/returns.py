# SPDX-License-Identifier: BSD-3-Clause
"""Return maps of sections that the run meets: a coordinate on its way, an apex, a touchdown, a while. Where, and when, the
section is reached to first order, beside quotients of returns."""
from typing import Any, List

import numpy as np

import contact_flow as cf
from trial import OPTIONS, Trial, hold_against_quotients

SHORTEST = 1e-6  # [s] of a return
TOLERANCE = 1e-10  # of derivatives


def draw_sections(trial: Trial, rng: np.random.Generator) -> List[Any]:
    """One of each kind, as far as the run meets them."""
    robot, run, duration = trial.robot, trial.run, trial.draft.duration
    names = [name for name in robot.velocities if name in robot.state_names and name != "clock"]
    sections: List[Any] = [cf.After(float(rng.uniform(0.2, 0.9)) * duration)]
    hit = sorted({name for event in run.events for name in event.activated})
    if hit:
        sections.append(cf.Touchdown(str(rng.choice(hit))))
    if names:
        name, at = str(rng.choice(names)), float(rng.uniform(0.2, 0.9)) * duration
        now, later = run.x(at), run.x(min(at + 1e-6, duration))
        place = robot.state_names.index(name)
        sections.append(cf.Crossing(name, float(now[place]), int(np.sign(later[place] - now[place]))))
        sections.append(cf.Apex(name))
    return sections


def judge(trial: Trial) -> None:
    """Each section along one direction."""
    robot, verdict, rng = trial.robot, trial.verdict, trial.random(57)
    w = trial.direction(rng)
    for section in draw_sections(trial, rng):
        kind = f"{section.kind} {section.sign}"
        returns = robot.poincare(section, horizon=trial.draft.duration, shortest=SHORTEST, tolerance=TOLERANCE,
                                 max_seconds_total=30, **OPTIONS)
        try:
            here = returns()
        except cf.BudgetExceeded:
            verdict.counts[f"return to {kind}: budget"] += 1
            continue
        verdict.counts[f"return to {kind}: {here.status}"] += 1
        try:
            told = np.append(here.map(w), here.return_time(w))
        except (ValueError, RuntimeError):
            continue

        def quotient(alpha: float) -> Any:
            there = returns(robot.perturb(robot.nominal.x, alpha * w), derivative=False)
            if not there:
                return None
            return np.append(robot.separation(there.x, here.x), there.time - here.time) / alpha

        hold_against_quotients(verdict, f"return to {kind}", told, 0, 1, quotient)
