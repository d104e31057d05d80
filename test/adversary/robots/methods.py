# SPDX-License-Identifier: BSD-3-Clause
"""Other methods and tolerances, from loose ones to the strictest, beside the run at 1e-12: states within what is told of
their error, and derivatives within what both tell."""
import numpy as np

from trial import DERIVATIVE, OPTIONS, Trial, error_of


def judge(trial: Trial) -> None:
    """Each method at a random tolerance."""
    robot, verdict, rng = trial.robot, trial.verdict, trial.random(9)
    for method in ("explicit", "implicit", "automatic"):
        tolerance = 10.0 ** -int(rng.integers(4, 15))
        run = robot.simulate(robot.nominal.x, trial.draft.duration, relative_tolerance=tolerance,
                             absolute_tolerance=tolerance, method=method, max_seconds=OPTIONS["max_seconds"])
        if not run.status.ok:
            verdict.counts[f"{method} run: {run.status.outcome}"] += 1
            continue
        B = run.derivative(**DERIVATIVE)
        if not B.status.ok:
            verdict.counts[f"{method} derivative: {B.status.outcome}"] += 1
            continue
        error = np.abs(robot.separation(run.final_state, trial.run.final_state))
        told = np.abs(np.asarray(B.trust.state_error))
        verdict.weigh(f"state, {method}", bool((error <= 10 * told + 1e-9).all()),
                      f"at {tolerance:.0e} off by {error.max():.2e}, told {told.max():.2e}")
        words = [[event.mode_after for event in one.events] for one in (run, trial.run)]
        if trial.derivative is None or words[0] != words[1]:
            continue
        w = trial.direction(rng)
        try:
            b, other = trial.derivative(w), B(w)
            stated = float(np.linalg.norm(error_of(B, w)) + np.linalg.norm(error_of(trial.derivative, w)))
        except (ValueError, RuntimeError):
            continue
        apart, size = float(np.linalg.norm(other - b)), 1 + float(np.linalg.norm(b))
        verdict.weigh(f"derivative, {method}", apart <= 10 * stated + 1e-7 * size,
                      f"at {tolerance:.0e} {apart:.2e} of {size - 1:.2e} apart, stated {stated:.1e}")
