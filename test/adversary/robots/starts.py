# SPDX-License-Identifier: BSD-3-Clause
"""Runs that begin in contact: from a state on the way of the run they go on as it does, and have derivatives along directions
that keep the contacts, beside quotients of runs from there."""
from typing import Any

import numpy as np

from trial import AT_REST, DERIVATIVE, OPTIONS, Trial, error_of, hold_against_quotients

NEAR = 1e-3  # [s] of an event: the words of the two runs may differ there
LEAVES = 30  # times α²: by what starts beside it leave their contacts


def judge(trial: Trial) -> None:
    """From two places on the way."""
    robot, verdict, rng, duration = trial.robot, trial.verdict, trial.random(63), trial.draft.duration
    for _ in range(2):
        at = float(rng.uniform(0.1, 0.9)) * duration
        if any(abs(event.t - at) < NEAR for event in trial.run.events):
            continue
        here = np.array(robot.simulate(robot.nominal.x, at, **OPTIONS).final_state)
        word = next(arc.word for arc in trial.run.arcs if arc.t_end >= at)
        try:
            rest = robot.simulate(here, duration - at, **OPTIONS)
        except ValueError as refusal:
            verdict.counts[f"start refused: {'several motions' if 'several motions fit' in str(refusal) else 'other'}"] += 1
            verdict.contradictions += [] if "several motions fit" in str(refusal) else [f"start at {at} refused: {refusal}"]
            continue
        if not rest.status.ok:
            verdict.weigh("start", rest.status.outcome == "budget exceeded", f"at {at}: {rest.status.message}")
            continue
        if not any(warning.code == "indeterminate forces" for warning in rest.warnings):  # which of them carry is not unique
            verdict.weigh("word of a start", rest.arcs[0].word == word, f"at {at} {rest.arcs[0].word}, on the way {word}")
        apart = float(np.linalg.norm(robot.separation(rest.final_state, trial.run.final_state)))
        size = 1 + float(np.linalg.norm(trial.run.final_state))
        stated = 0.0 if trial.derivative is None else float(np.linalg.norm(trial.derivative.trust.state_error))
        rests = trial.derivative is None and any(warning.code == "zeno" for warning in trial.run.warnings)
        known = (AT_REST if rests else 1e-7) * size + 10 * stated
        verdict.weigh("end from a start", apart <= known, f"at {at} {apart:.2e} apart, told {stated:.1e}")
        B = rest.derivative(**DERIVATIVE)
        verdict.counts[f"derivative from a start: {B.status.outcome}"] += 1
        if not B.status.ok or set(word) == {"o"}:
            continue
        w = rng.normal(size=2 * robot.dof)
        if "clock" in robot.velocities:
            w[robot.dof + robot.velocities.index("clock")] = 0
        w = np.array(B.project(w))
        for sign in (1, -1):
            try:
                b, stated = B(sign * w), float(np.linalg.norm(error_of(B, sign * w)))
                radius = float(B.radius(sign * w))
            except (ValueError, RuntimeError):
                verdict.counts["direction from a start refused"] += 1
                continue

            def quotient(alpha: float) -> Any:
                room = max(1e-9, LEAVES * alpha ** 2)
                run = robot.simulate(robot.perturb(here, alpha * sign * w), duration - at, gap_tolerance=room,
                                     speed_tolerance=room, **OPTIONS)
                return robot.separation(run.final_state, rest.final_state) / alpha if run.status.ok else None

            hold_against_quotients(verdict, "direction from a start", b, stated, radius, quotient)
