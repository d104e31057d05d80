# SPDX-License-Identifier: BSD-3-Clause
"""Inputs on a grid, one change of them at the very instant of an event: the gradient of a cost by start, inputs, instants
and duration, the map of all inputs, and the chain of linearized intervals, beside quotients of runs."""
from typing import Any, Callable, Dict, Optional

import numpy as np

import contact_flow as cf
from costs import draw_cost
from trial import DERIVATIVE, OPTIONS, Trial, hold_against_quotients

RADIUS = 1e-3  # of quotients; further away they need not be near


def driven(trial: Trial) -> Optional[cf.Robot]:
    """The robot with a motor on each joint, where it has no inputs; None where it has no joint, either."""
    if trial.robot.inputs:
        return trial.robot
    draft = trial.draft.copy()
    joints = [name for name in trial.robot.velocities if name in draft.urdf and not name.startswith("base_")]
    for joint in joints:
        draft.yaml["efforts"][f"{joint}_motor"] = {"kind": "actuator", "joint": joint, "gear": 1.0, "input": f"{joint}_e"}
    return cf.Robot.from_strings(draft.urdf, draft.text()) if joints else None


def draw_grid(robot: cf.Robot, duration: float, rng: np.random.Generator) -> cf.Grid:
    """Two or three changes; the last is sometimes where an event of the run is, which does not know of it."""
    nominal = np.array(robot.nominal.u, float)
    times = np.concatenate([[0], np.sort(rng.uniform(0.05, 0.9, int(rng.integers(2, 4)))) * duration])
    values = nominal + rng.normal(0, 0.3, (times.size, nominal.size))
    if rng.random() < 0.4:
        before = robot.simulate(robot.nominal.x, duration, inputs=cf.Grid(times[:-1], values[:-1]), **OPTIONS)
        later = [event.t for event in before.events if times[-2] < event.t < duration] if before.status.ok else []
        if later:
            times[-1] = rng.choice(later)
    return cf.Grid(times, values)


class Schedule:
    """A run under a grid of inputs, and runs beside it."""

    def __init__(self, trial: Trial, robot: cf.Robot, grid: cf.Grid, rng: np.random.Generator):
        self.trial, self.robot, self.grid, self.duration = trial, robot, grid, trial.draft.duration
        self.run = self.beside()
        self.cost: Dict[str, Any] = draw_cost(trial, rng)
        self.cost["effort"] = {name: float(rng.uniform(0, 0.1)) for name in robot.inputs}

    def beside(self, w: Any = None, du: Any = 0.0, dt: Any = 0.0, longer: float = 0.0) -> Any:
        """The run with these changes of start, inputs, instants of change, and duration."""
        x = self.robot.nominal.x if w is None else self.robot.perturb(self.robot.nominal.x, w)
        times = self.grid.t.copy()
        times[1:] += dt
        return self.robot.simulate(x, self.duration + longer, inputs=cf.Grid(times, self.grid.u + du), **OPTIONS)

    def hold(self, what: str, told: Any, stated: float, change: Callable[[float], Any], of_cost: bool = True,
             **piece: Any) -> None:
        """What is told of a direction beside quotients of costs, or of states, of runs `change(α)`."""
        here = self.run.gradient(**self.cost, **piece).cost if of_cost else None

        def quotient(alpha: float) -> Any:
            run = change(alpha)
            if not run.status.ok:
                return None
            if not of_cost:
                return self.robot.separation(run.final_state, self.run.final_state) / alpha
            gradient = run.gradient(**self.cost, **piece)
            return np.array([gradient.cost - here]) / alpha if gradient else None

        hold_against_quotients(self.trial.verdict, f"schedule, {what}", np.atleast_1d(told), stated, RADIUS, quotient)


def hold_gradient(of: Schedule, w: np.ndarray, du: np.ndarray, stated: float) -> None:
    """By start and inputs at once; by each instant and the duration, where it is that of all pieces."""
    counts = of.trial.verdict.counts
    piece = {"direction": w, "direction_inputs": du}
    try:
        gradient = of.run.gradient(**of.cost, **piece)
    except (ValueError, RuntimeError):
        counts["schedule, cost refused"] += 1
        return
    if not gradient:
        counts[f"schedule, cost: {gradient.status.outcome}"] += 1
        return
    size = 1 + abs(gradient.cost)
    told = gradient.initial @ w + float(np.sum(gradient.inputs * du))
    of.hold("cost", told, stated * size, lambda a: of.beside(a * w, a * du), **piece)
    for k, slope in enumerate(gradient.instants):
        if gradient.whole and np.isfinite(slope):
            dt = np.eye(len(gradient.instants))[k]
            for sign in (1, -1):
                of.hold("cost by an instant", sign * slope, stated * size,
                        lambda a, dt=sign * dt: of.beside(dt=a * dt), **piece)
        else:
            counts["schedule, no derivative by an instant"] += 1
    if np.isfinite(gradient.duration):
        of.hold("cost by duration", gradient.duration, stated * size, lambda a: of.beside(longer=a), **piece)


def hold_states(of: Schedule, w: np.ndarray, du: np.ndarray, stated: float) -> None:
    """The map of all inputs, and the chain of the intervals."""
    counts = of.trial.verdict.counts
    try:
        ends = of.run.input_map()(du.ravel())
    except (ValueError, RuntimeError) as refusal:
        counts[f"schedule, no map of inputs: {type(refusal).__name__}"] += 1
    else:
        of.hold("map of inputs", ends, stated, lambda a: of.beside(du=a * du), of_cost=False)
    intervals = of.run.linearize()
    if not all(i.status.ok and i.is_linear for i in intervals):
        counts["schedule, no linear chain"] += 1
        return
    dx = w
    for interval, u in zip(intervals, du):
        dx = interval.A @ dx + interval.B @ u
    of.hold("chain of intervals", dx, stated, lambda a: of.beside(a * w, a * du), of_cost=False)


def judge(trial: Trial) -> None:
    """One grid and one direction."""
    rng, counts = trial.random(91), trial.verdict.counts
    robot = driven(trial)
    if robot is None:
        counts["schedule: no joints"] += 1
        return
    of = Schedule(trial, robot, draw_grid(robot, trial.draft.duration, rng), rng)
    if not of.run.status.ok:
        counts[f"schedule: {of.run.status.outcome}"] += 1
        return
    B = of.run.derivative(**DERIVATIVE)
    counts[f"schedule, derivative: {B.status.outcome}"] += 1
    stated = float(B.trust.derivative_error) if B.status.ok else 1e-6
    w = trial.direction(rng)
    du = rng.normal(size=of.grid.u.shape)
    du /= np.linalg.norm(du)
    hold_gradient(of, w, du, stated)
    hold_states(of, w, du, stated)
