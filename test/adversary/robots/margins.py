# SPDX-License-Identifier: BSD-3-Clause
"""The smallest minima of gaps that stay open and of forces that go on pushing, which a run tells as margins, beside those of
its motion as it is seen at many instants: inside arcs, where arcs meet, and where an impact elsewhere turns a gap."""
from typing import Any, Dict, Iterator, Optional, Tuple

import numpy as np

import contact_flow as cf
from schedules import draw_grid, driven
from trial import OPTIONS, Trial

INSTANTS = 1500  # of an arc
SHORT = 1e-9  # arcs that are hardly seen [s]
CHANGE = {"gap": 1e-7, "force": 1e-5}  # what is none, relative
PART, LEAST = 0.1, {"gap": 1e-6, "force": 1e-5}  # how near the margins are asked to be


class Minimum:
    """Of one guard along a run."""

    def __init__(self, value: float, change: float):
        self.extreme, self.change, self.falling, self.lowest = value, change, False, np.inf

    def add(self, value: float) -> None:
        """The next value; a minimum is known as soon as the guard rises again."""
        change = self.change * abs(self.extreme)
        if value < self.extreme if self.falling else value > self.extreme:
            self.extreme = value
        elif self.falling and value > self.extreme + change:
            self.lowest, self.falling, self.extreme = min(self.lowest, self.extreme), False, value
        elif not self.falling and value < self.extreme - change:
            self.falling, self.extreme = True, value


def guards(robot: cf.Robot, run: Any) -> Iterator[Dict[Tuple[str, int], np.ndarray]]:
    """Of each arc that lasts, the gaps and forces at instants of it."""
    nq, count = robot.num_positions, len(robot.constraints)
    for arc in run.arcs:
        length = arc.t_end - arc.t_begin
        if length < SHORT:
            continue
        instants = np.linspace(arc.t_begin, arc.t_end, INSTANTS)
        instants[[0, -1]] += np.array([1, -1]) * 1e-9 * length
        gaps = np.array([robot.gaps(x[:nq]) for x in run.x(instants)])
        forces = np.array([run.force(t)[:count] for t in instants])
        yield {("gap", i) if arc.word[i] == "o" else ("force", i): gaps[:, i] if arc.word[i] == "o" else forces[:, i]
               for i in range(count)}


def seen(robot: cf.Robot, run: Any) -> Dict[str, float]:
    """The smallest minimum of each kind, above what is an event."""
    lowest = {"gap": np.inf, "force": np.inf}
    minima: Dict[Tuple[str, int], Minimum] = {}
    for arc in guards(robot, run):
        minima = {key: minima.get(key) or Minimum(values[0], CHANGE[key[0]]) for key, values in arc.items()}
        for key, values in arc.items():
            for value in values:
                minima[key].add(value)
            if minima[key].lowest > LEAST[key[0]]:
                lowest[key[0]] = min(lowest[key[0]], minima[key].lowest)
    return lowest


def hold(trial: Trial, robot: cf.Robot, grid: Optional[cf.Grid]) -> None:
    """The margins of one run, held inputs or on a grid."""
    inputs = {} if grid is None else {"inputs": grid}
    run = robot.simulate(robot.nominal.x, trial.draft.duration, **inputs, **OPTIONS)
    word = "held" if grid is None else "grid"
    if not run.status.ok or any("s" in mode for mode in run.mode_words):
        trial.verdict.counts["margins: cones, or no run"] += 1  # of what sticks the cone is the guard
        return
    told = {"gap": run.margins.gap, "force": run.margins.force}
    for kind, value in seen(robot, run).items():
        right = told[kind] <= (1 + PART) * value + LEAST[kind]
        trial.verdict.weigh(f"margin of {kind}", bool(right), f"{word}: {told[kind]:.6g}, where it comes to {value:.6g}")


def judge(trial: Trial) -> None:
    """With the inputs of the robot, and with motors on a grid."""
    hold(trial, trial.robot, None)
    robot = driven(trial)
    if robot is not None:
        hold(trial, robot, draw_grid(robot, trial.draft.duration, trial.random(90)))
