# SPDX-License-Identifier: BSD-3-Clause
"""A run along with a clock, looked at and marked at random instants and given other inputs on the way, beside the run that
knows all of it beforehand: states, events and derivatives since the marks."""
from typing import Any, List

import numpy as np

import contact_flow as cf
from trial import DERIVATIVE, OPTIONS, Trial, error_of

TICKS = 40  # looks at the motion
NEAR = 1e-4  # [s] a mark so close to an event may be on its other side


def drawn_inputs(trial: Trial, rng: np.random.Generator) -> Any:
    """The inputs of the run, changed once or twice on the way, on a grid; None where the robot has none."""
    nominal = np.array(trial.robot.nominal.u, float)
    if not nominal.size:
        return None
    changes = np.sort(rng.uniform(0.1, 0.9, int(rng.integers(1, 3)))) * trial.draft.duration
    values = np.array([nominal] + [nominal + rng.normal(0, 0.1, nominal.size) for _ in changes])
    return cf.Grid(np.concatenate([[0], changes]), values)


def simulate(trial: Trial, x: Any, duration: float, inputs: Any) -> Any:
    """The run that knows its inputs."""
    more = {} if inputs is None else {"inputs": inputs}
    return trial.robot.simulate(x, duration, **more, **OPTIONS)


def follow(flow: Any, until: float, inputs: Any, rng: np.random.Generator, events: List[Any]) -> bool:
    """Goes on to an instant by small parts; inputs change when their time comes. False where it ends before."""
    ticks = np.sort(rng.uniform(flow.now, until, TICKS)).tolist()
    changes = [] if inputs is None else [(t, u) for t, u in zip(inputs.t, inputs.u) if flow.now < t < until]
    for t, u in sorted([(t, None) for t in ticks] + changes + [(until, None)], key=lambda at: at[0]):
        event = flow.advance_to(t)
        while event is not None:
            events.append(event)
            event = flow.advance_to(t)
        if not flow.status.ok or flow.now < t:
            return False
        if u is not None:
            flow.set_input(u)
    return True


def rest_of(inputs: Any, at: float) -> Any:
    """A grid from an instant on."""
    if inputs is None:
        return None
    times, values = inputs.t, inputs.u
    first = int(np.searchsorted(times, at, side="right")) - 1
    return cf.Grid(np.concatenate([[0], times[first + 1:] - at]), values[first:])


def compare_tangents(trial: Trial, tangents: Any, run: Any) -> None:
    """What the flow tells beside the derivative of the run since the mark."""
    verdict = trial.verdict
    B = run.derivative(**DERIVATIVE)
    if not tangents.status.ok or not B.status.ok:
        verdict.counts[f"rolling {tangents.status.outcome}, of the run {B.status.outcome}"] += 1
        return
    for w, told in zip(np.asarray(tangents.directions), np.asarray(tangents.tangents)):
        try:
            expected, stated = B(w), float(np.linalg.norm(error_of(B, w)))
        except (ValueError, RuntimeError):
            verdict.counts["rolling direction refused"] += 1
            continue
        apart, size = float(np.linalg.norm(told - expected)), 1 + float(np.linalg.norm(expected))
        verdict.weigh("rolling derivative", apart <= 10 * stated + 1e-6 * size,
                      f"since {tangents.t_mark} {apart:.2e} of {size - 1:.2e} apart, stated {stated:.1e}")


def mark(trial: Trial, flow: Any, rng: np.random.Generator) -> bool:
    """Marks now, along some directions or along all; False where that is refused."""
    try:
        if rng.random() < 0.3:
            flow.mark(tolerance=DERIVATIVE["tolerance"])
        else:
            flow.mark([trial.direction(rng) for _ in range(3)], tolerance=DERIVATIVE["tolerance"])
        return True
    except (ValueError, RuntimeError):  # contacts that the directions do not keep
        trial.verdict.counts["mark refused"] += 1
    return False


def judge(trial: Trial) -> None:
    """Once from the start, with a mark there, and once more from a mark on the way."""
    robot, verdict, rng = trial.robot, trial.verdict, trial.random(11)
    duration, inputs = trial.draft.duration, drawn_inputs(trial, rng)
    run = simulate(trial, robot.nominal.x, duration, inputs)
    if not run.status.ok:
        verdict.counts[f"run with inputs: {run.status.outcome}"] += 1
        return
    flow, events = robot.online(**OPTIONS), []
    marked = mark(trial, flow, rng)
    middle = float(rng.uniform(0.2, 0.8)) * duration
    for place in (middle, duration):
        if not follow(flow, place, inputs, rng, events):
            verdict.weigh("online run", False, f"ends at {flow.now}: {flow.status.message}")
            return
        if place == middle and rng.random() < 0.5:
            marked = mark(trial, flow, rng)
            begin, x_begin = flow.now, flow.x
        elif place == middle:
            begin, x_begin = 0.0, robot.nominal.x
    apart = float(np.abs(robot.separation(flow.x, run.final_state)).max())
    verdict.weigh("online state", apart <= 1e-7, f"{apart:.2e} apart")
    times = [event.t for event in run.events]
    late = max([abs(event["t"] - t) for event, t in zip(events, times)], default=0)
    verdict.weigh("online events", len(events) == len(times) and late <= 1e-8,
                  f"{len(events)} beside {len(times)}, up to {late:.2e} s apart")
    if not marked or any(abs(t - begin) < NEAR for t in times):
        return
    since = run if begin == 0 else simulate(trial, x_begin, duration - begin, rest_of(inputs, begin))
    if since.status.ok:
        compare_tangents(trial, flow.tangents, since)
