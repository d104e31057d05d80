# SPDX-License-Identifier: BSD-3-Clause
"""The smallest minima of gaps that stay open and of forces that go on pushing, which a run tells as margins, beside those of
its motion as it is seen at many instants: inside arcs, where arcs meet, and where an impact elsewhere turns a gap."""
from typing import Any, Dict, Iterator, List, Optional, Tuple

import numpy as np

import contact_flow as cf
from schedules import draw_grid, driven
from trial import Trial

INSTANTS, EDGE = 1500, 60  # of an arc, and more of them towards where it begins, as parts of its length
PLACES = np.unique(np.concatenate([np.linspace(1e-9, 1 - 1e-9, INSTANTS), np.geomspace(1e-9, 1 / INSTANTS, EDGE)]))
SHORT = 1e-9  # arcs that are hardly seen [s]
ABOVE, BELOW = 0.1, 0.5  # how near the margins are asked to be: where much varies, a lower bound is told
CHOICES: List[Dict[str, Any]] = [
    dict(method=method, relative_tolerance=tolerance, absolute_tolerance=tolerance, max_seconds=20)
    for method in ("automatic", "explicit", "implicit") for tolerance in (1e-6, 1e-9, 1e-12)]
Seen = Dict[str, List[float]]


def change(kind: str, tolerance: float) -> float:
    """What is no change, relative."""
    return max({"gap": 1e-7, "force": 1e-5}[kind], 10 * tolerance)


def least(kind: str, tolerance: float) -> float:
    """Minima below this [m, N] are events, or nearly: which of them come is not asked."""
    return max({"gap": 1e-6, "force": 1e-5}[kind], 100 * tolerance)


class Minimum:
    """Of one guard along a run, in which changes below a part of it and below what methods err by are none."""

    def __init__(self, value: float, part: float, error: float):
        self.extreme, self.part, self.error, self.falling = value, part, error, False

    def add(self, value: float) -> Optional[float]:
        """The next value; a minimum is known as soon as the guard rises again."""
        none, extreme = max(self.part * abs(self.extreme), self.error), self.extreme
        if value < extreme if self.falling else value > extreme:
            self.extreme = value
        elif self.falling and value > extreme + none:
            self.falling, self.extreme = False, value
            return extreme
        elif not self.falling and value < extreme - none:
            self.falling, self.extreme = True, value
        return None


def guards(robot: cf.Robot, run: Any) -> Iterator[Dict[Tuple[str, int], np.ndarray]]:
    """Of each arc the gaps and forces at instants of it; at none of one that hardly lasts."""
    nq, count = robot.num_positions, len(robot.constraints)
    for arc in run.arcs:
        length = arc.t_end - arc.t_begin
        kinds = ["gap" if letter == "o" else "force" for letter in arc.word]
        if length < SHORT:
            yield {(kind, i): np.array([]) for i, kind in enumerate(kinds)}
            continue
        instants = arc.t_begin + length * PLACES
        values = {"gap": np.array([robot.gaps(x[:nq]) for x in run.x(instants)]),
                  "force": np.array([run.force(t)[:count] for t in instants])}
        yield {(kind, i): values[kind][:, i] for i, kind in enumerate(kinds)}


def seen(arcs: List[Dict[Tuple[str, int], np.ndarray]], tolerance: Optional[float]) -> Seen:
    """All minima of each kind, however shallow where no tolerance is given."""
    found: Seen = {"gap": [], "force": []}
    minima: Dict[Tuple[str, int], Minimum] = {}
    for arc in arcs:
        minima = {key: minimum for key, minimum in minima.items() if key in arc}
        for key, values in arc.items():
            for value in values:
                part, error = (0.0, 0.0) if tolerance is None else (change(key[0], tolerance), 10 * tolerance)
                minimum = minima.setdefault(key, Minimum(value, part, error)).add(value)
                found[key[0]] += [] if minimum is None else [minimum]
    return found


def hold(trial: Trial, robot: cf.Robot, grid: Optional[cf.Grid], options: Dict[str, Any]) -> None:
    """The margins of one run, held inputs or on a grid."""
    inputs = {} if grid is None else {"inputs": grid}
    run = robot.simulate(robot.nominal.x, trial.draft.duration, **inputs, **options)
    tolerance = options["absolute_tolerance"]
    word = f"{'held' if grid is None else 'grid'}, {options['method']}, {tolerance:g}"
    if not run.status.ok or any("s" in mode for mode in run.mode_words):
        trial.verdict.counts["margins: cones, or no run"] += 1  # of what sticks the cone is the guard
        return
    told = {"gap": run.margins.gap, "force": run.margins.force}
    arcs = list(guards(robot, run))
    deep, all_of_them = seen(arcs, tolerance), seen(arcs, None)
    shared = any(warning.code == "indeterminate forces" for warning in run.warnings)  # a bound of such forces is told
    for kind in ("gap",) if shared else ("gap", "force"):
        floor = least(kind, tolerance)
        lowest = min([value for value in deep[kind] if value > floor], default=np.inf)
        trial.verdict.weigh(f"margin of {kind}", bool(told[kind] <= (1 + ABOVE) * lowest + floor),
                            f"{word}: {told[kind]:.6g}, where it comes to {lowest:.6g}")
        if floor < told[kind] < np.inf and all(arc.t_end - arc.t_begin >= SHORT for arc in run.arcs):
            lowest = min([value for value in all_of_them[kind] if value > floor], default=np.inf)
            trial.verdict.weigh(f"margin of {kind} that is seen", bool(told[kind] >= (1 - BELOW) * lowest - floor),
                                f"{word}: {told[kind]:.6g}, where it comes to {lowest:.6g} only")


def judge(trial: Trial) -> None:
    """With the inputs of the robot, and with motors on a grid; by methods and tolerances that are drawn."""
    rng = trial.random(90)
    hold(trial, trial.robot, None, CHOICES[int(rng.integers(len(CHOICES)))])
    robot = driven(trial)
    if robot is not None:
        grid = draw_grid(robot, trial.draft.duration, rng)
        hold(trial, robot, grid, CHOICES[int(rng.integers(len(CHOICES)))])
