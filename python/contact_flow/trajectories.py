# SPDX-License-Identifier: BSD-3-Clause
"""Trajectories through contact: inputs on a grid of least cost, and policies as files."""
from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .sections import Grid

Array = NDArray[np.float64]
Numbers = Union[ArrayLike, Mapping[str, float], None]
Condition = Mapping[str, Any]
#: (iteration, cost, best, violation, step, pieces, what it met of kinks) → False to end the search
Progress = Callable[[int, float, float, float, float, int, str], Any]
MINIMA = ("smooth minimum", "valley")
METHODS = ("pieces", "multiple_shooting")


@dataclass(frozen=True)
class OptimalTrajectory:
    """Where a search ended; true at a minimum, smooth or on a kink.

    verdict: 'smooth minimum', 'valley', 'stalled', 'undefined', …, and `message` as a sentence. x0 [nq+d],
    `inputs` (and `input_end`, those at T, where they are led linearly), `parameters` and `duration` [s] are the best found, with `cost` J; `system` has these
    parameters. certificate: a dict for each piece that meets there, label, slopes (first event, second,
    time apart [s], by which J rises for each second), residual, decrease, hull_weight; hull_distance is 0
    where 0 is in the hull of the pieces' gradients. condition_values, multipliers: c and λ of each condition.
    iterations: (number, cost, best, violation, step, pieces, kink) of each."""

    system: _core.System
    verdict: str
    message: str
    cost: float
    x0: Array
    inputs: Grid
    input_end: Optional[Array]
    duration: float
    parameters: Dict[str, float]
    condition_values: Array
    multipliers: Array
    certificate: List[Dict[str, Any]]
    hull_distance: float
    iterations: List[Tuple[int, float, float, float, float, int, str]]
    valleys: int
    simulations: int
    derivatives: int
    options: Dict[str, Any] = field(repr=False)

    def __bool__(self) -> bool:
        return self.verdict in MINIMA

    def __repr__(self) -> str:
        return "<OptimalTrajectory of %s: %s, cost %.10g, %d iterations>" % (
            self.system.name, self.verdict, self.cost, len(self.iterations))

    def run(self) -> _core.Run:
        """The run that was found, to be looked at, differentiated, followed by run().policy(). Where inputs are led
        linearly it is one of LinearInputs(system)."""
        if self.input_end is None:
            return self.system.simulate(self.x0, self.duration, self.inputs, **self.options)
        led = _core.LinearInputs(self.system)
        t = np.append(self.inputs.t, self.inputs.t[0] + self.duration)
        held = led.lead_inputs(t, np.vstack([self.inputs.u, self.input_end]))
        return led.simulate(led.lead_state(self.x0, t[0]), self.duration, Grid(self.inputs.t, held), **self.options)


def one_condition(number: int, given: Condition, instants: int) -> Tuple[str, str, int, float, float]:
    """(kind, name, number, lower, upper). ValueError for a field that there is none of."""
    what = "conditions[%d]" % number
    known = ("name", "touchdown", "instant", "occurrence", "value", "lower", "upper")
    for key in given:
        if key not in known:
            raise ValueError("%s has no field '%s'; it has %s" % (what, key, ", ".join(known)))
    if ("name" in given) == ("touchdown" in given):
        raise ValueError("%s has either 'name', of a number of the state, or 'touchdown', of a constraint" % what)
    if "value" in given and ("lower" in given or "upper" in given):
        raise ValueError("%s has 'value' and bounds" % what)
    lower = float(given.get("value", given.get("lower", -math.inf)))
    upper = float(given.get("value", given.get("upper", math.inf)))
    if not lower <= upper:
        raise ValueError("%s: lower is %r, upper %r" % (what, lower, upper))
    if "touchdown" in given:
        return "touchdown", str(given["touchdown"]), int(given.get("occurrence", 0)), lower, upper
    return "state", str(given["name"]), int(given.get("instant", instants)), lower, upper


def optimize_trajectory(
        system: _core.System, inputs: Union[Grid, ArrayLike], target: Numbers = None, weight: Numbers = None, *,
        effort: Numbers = None, input_reference: Numbers = None, path_target: Numbers = None,
        path_weight: Numbers = None, path_reference: Optional[ArrayLike] = None, duration_weight: float = 0.0,
        power: Sequence[Tuple[str, str, float]] = (), impulse: Mapping[str, float] = {}, slip: Mapping[str, float] = {},
        linear_inputs: bool = False, input_end: Numbers = None,
        x0: Optional[_core.State] = None, duration: Optional[float] = None, choose_inputs: bool = True,
        choose_initial: Sequence[str] = (), choose_parameters: Sequence[str] = (),
        choose_durations: Sequence[int] = (), keep_horizon: bool = False,
        conditions: Sequence[Condition] = (), condition_tolerance: float = 1e-8, lower: Numbers = None,
        upper: Numbers = None, initial_lower: Optional[ArrayLike] = None,
        initial_upper: Optional[ArrayLike] = None, parameter_lower: Optional[ArrayLike] = None,
        parameter_upper: Optional[ArrayLike] = None, duration_lower: Optional[ArrayLike] = None,
        duration_upper: Optional[ArrayLike] = None, kink_interval: float = 1e-6, max_iterations: int = 500,
        tolerance: float = 1e-10, neighbours: bool = False, method: str = "pieces", segments: Sequence[int] = (),
        states: Optional[ArrayLike] = None, progress: Optional[Progress] = None,
        max_seconds_total: float = math.inf, **options: Any) -> OptimalTrajectory:
    """Minimises, over the inputs u_k that `inputs`, a Grid of K instants, begins with,

      J = Σ h_k effort (u_k − input_reference)² + Σ h_k path_weight (q(t_{k+1}) − path_target)²
          + Σ weight (x(T) − target)² + duration_weight T
          + ∫ w (u v)² dt for each (input u, velocity v, w) of `power`
          + Σ w p² over the impulses of each contact, as others touch down too, and w of `impulse`
          + ∫ w |slip|² dt while they touch, for each contact with friction and w of `slip`,

    without factors ½. Numbers are dicts by name or arrays: target, weight [nq+d]; effort, input_reference,
    lower, upper [m], which bound what they name alone; path_target, path_weight [nq]; weights are 1 for each target
    where they are left out.
    path_reference [K×nq]: a target for each instant. Inputs are held; with linear_inputs they are led
    linearly from instant to instant, the last one to T, where the search begins with input_end. choose_inputs=False keeps the inputs; choose_initial
    names tangents of the start that are chosen, too, choose_parameters parameters, choose_durations
    intervals (from 0) whose lengths are, and T with them unless keep_horizon; bounds in their order, of parameters
    and lengths themselves, but initial_lower and initial_upper of changes of the start. Lengths without bounds keep
    within a tenth and ten times of what they are.

    conditions are dicts: {'name': 'z', 'value': 1} at T, or with 'lower', 'upper' and 'instant' 1 … K;
    {'touchdown': 'floor', 'value': 0.9} [s], 'occurrence' from 0. method="multiple_shooting" is by Ipopt
    (have_ipopt): segments begin at these instants of the grid, from 1 (none given: where nothing touches), in `states`
    [segments × nq+d]; it gives no certificate. progress(iteration, cost, best, violation,
    step, pieces, kink) is called after each iteration; returning False ends the search. Options are those
    of simulate and of derivatives, tight by default. Ctrl-C raises KeyboardInterrupt; beyond max_seconds_total
    the verdict is 'cancelled'. ValueError, naming the field, for what is not in order.

    >>> from contact_flow import Grid, Model
    >>> ball = Model("driven_ball")
    >>> found = ball.optimize_trajectory(Grid([0, 0.25, 0.5, 0.75], np.zeros((4, 1))), {"z": 1, "d/dt z": 0},
    ...                                  {"z": 100, "d/dt z": 100}, effort=[0.01])
    >>> found.verdict, round(found.cost, 10)
    ('smooth minimum', 0.7976963267)
    """
    if method not in METHODS:
        raise ValueError("method is %r, expected one of %s" % (method, ", ".join(METHODS)))
    if method == "pieces" and (len(segments) > 0 or states is not None):
        raise ValueError("segments and states are those of method='multiple_shooting'")
    if method != "pieces" and neighbours:
        raise ValueError("neighbours are tried by method='pieces' alone")
    instants = len(inputs.t) if isinstance(inputs, Grid) else 1
    asked: Dict[str, Any] = dict(
        inputs=inputs, target={} if target is None else target, weight=weight, effort=effort,
        input_reference=input_reference, path_target={} if path_target is None else path_target,
        path_weight=path_weight, path_reference=path_reference, duration_weight=float(duration_weight), x0=x0,
        power=list(power), impulse=dict(impulse), slip=dict(slip), linear_inputs=bool(linear_inputs), input_end=input_end,
        duration=duration, choose_inputs=bool(choose_inputs), keep_horizon=bool(keep_horizon),
        conditions=[one_condition(k, c, instants) for k, c in enumerate(conditions)],
        condition_tolerance=float(condition_tolerance), lower=lower, upper=upper, initial_lower=initial_lower,
        initial_upper=initial_upper, parameter_lower=parameter_lower, parameter_upper=parameter_upper,
        duration_lower=duration_lower, duration_upper=duration_upper, kink_interval=float(kink_interval),
        max_iterations=max_iterations, tolerance=tolerance, neighbours=bool(neighbours), method=method,
        segments=[int(k) for k in segments], states=states, options=options)
    for name, names in (("choose_initial", choose_initial), ("choose_parameters", choose_parameters),
                        ("choose_durations", choose_durations)):
        if isinstance(names, str):
            raise TypeError("%s is one text, expected a sequence" % name)
        asked[name] = list(names)
    if path_reference is not None and path_target is not None:
        raise ValueError("path_target and path_reference are both given")
    if path_reference is not None and path_weight is None:
        raise ValueError("path_reference needs a path_weight")
    found = _core._optimize_trajectory(system, asked, progress, max_seconds_total)
    grid = Grid(found.pop("t"), found.pop("u"))
    chosen = system.with_parameters(**found["parameters"]) if found["parameters"] else system
    return OptimalTrajectory(system=chosen, inputs=grid, **found)


def read_policy(path: Union[str, "os.PathLike[str]"]) -> _core.Policy:
    """A policy of a file, as write_policy and the node's save_policy write it."""
    with open(path, encoding="utf-8") as file:
        return _core.Policy.from_text(file.read(), os.fspath(path))


def write_policy(policy: _core.Policy, path: Union[str, "os.PathLike[str]"]) -> None:
    """Writes a policy as YAML, to the bit; the node's policy_tracker reads it."""
    text = policy.text
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
