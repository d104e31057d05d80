# SPDX-License-Identifier: BSD-3-Clause
"""What the judges of random robots share: a robot above its ground, its run, its derivative, what is counted, and when
quotients of runs contradict a derivative."""
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, Callable, List, Optional

import numpy as np

import contact_flow as cf
from generate import Draft

TOLERANCE = 1e-12
OPTIONS = dict(relative_tolerance=TOLERANCE, absolute_tolerance=TOLERANCE, max_seconds=20)
DERIVATIVE = dict(tolerance=1e-10, max_seconds=30)
AT_REST = 1e-3  # times the size of states: what bounces that are made rest change, where there is no derivative
STEPS = [10.0 ** -k for k in np.arange(3, 8.5, 0.5)]


@dataclass
class Verdict:
    """Of one robot: the words of its counts, and what contradicts it."""
    counts: Counter = field(default_factory=Counter)
    contradictions: List[str] = field(default_factory=list)

    def weigh(self, what: str, right: bool, found: str) -> None:
        """Counts a comparison, and keeps what was found where it is wrong."""
        self.counts[f"{what} {'right' if right else 'wrong'}"] += 1
        if not right:
            self.contradictions.append(f"{what}: {found}")


@dataclass
class Trial:
    """A robot whose contacts are above the ground, its run that ended well, and its derivative, if it has one."""
    seed: int
    draft: Draft
    robot: cf.Robot
    run: Any
    derivative: Any
    verdict: Verdict

    def random(self, judge: int) -> np.random.Generator:
        """Of a judge of its own, so that none depends on which others were there."""
        return np.random.default_rng([self.seed, judge])

    def direction(self, rng: np.random.Generator) -> np.ndarray:
        """A random tangent (δq, δv) of length 1 that leaves the rate of a clock alone, which is 1, and keeps closed loops."""
        w = unit(self.robot, rng.normal(size=2 * self.robot.dof))
        return w if self.derivative is None else unit(self.robot, np.array(self.derivative.project(w)))


def unit(robot: cf.Robot, w: np.ndarray) -> np.ndarray:
    """w as a tangent of length 1, without the rate of a clock."""
    if "clock" in robot.velocities:
        w[robot.dof + robot.velocities.index("clock")] = 0
    return w / np.linalg.norm(w)


def error_of(derivative: Any, w: Any) -> np.ndarray:
    """What is told of the error of B(w), by a second run, or by estimates where that takes long."""
    return np.asarray(derivative.error(w, max_seconds=DERIVATIVE["max_seconds"]))


def _moves(draft: Draft, name: str) -> bool:
    """Whether a coordinate of this name begins with a speed."""
    if name == "clock" or "_pad" in name:
        return False
    if not draft.level:
        return True
    return not re.search("_w[xyz]$|_angle$", name) if draft.placed else name in ("base_x", "base_y", "base_z")


def lowered(draft: Draft, rng: np.random.Generator) -> Optional[cf.Robot]:
    """The robot with a start whose contacts are above the ground, the lowest by a little; None where it has none."""
    nominal = draft.yaml["nominal"]
    if draft.yaml["base"] != "fixed":
        nominal["positions"]["base_z"] = 1.5
    robot = cf.Robot.from_strings(draft.urdf, draft.text())
    for name in robot.velocities:
        if _moves(draft, name):
            nominal["velocities"][name] = round(float(rng.normal(0, 0.7)), 4)
    for joint, other, ratio in draft.coupled:
        nominal["velocities"][joint] = ratio * nominal["velocities"][other]
    if draft.yaml["base"] == "fixed" and not draft.placed:  # the ground comes to the robot
        gaps = robot.gaps(robot.nominal.x[:robot.num_positions])
        for name, gap in zip(robot.constraints, gaps):
            constraint = draft.yaml["constraints"].get(name, {})
            shift = round(float(gap - rng.uniform(0.01, 0.2)), 4)
            if constraint.get("kind") == "plane":
                constraint["offset"] = shift
            elif constraint.get("kind") in ("height_field", "height_map", "stairs"):
                constraint["height"] = shift
            elif constraint.get("kind") == "box":
                constraint["center"][2] += shift
    elif not draft.placed:
        gaps = robot.gaps(robot.nominal.x[:robot.num_positions])
        low = min(gap for name, gap in zip(robot.constraints, gaps) if re.match(r"c\d|foot", name))
        nominal["positions"]["base_z"] = round(float(1.5 - 0.97 * low + rng.uniform(0.01, 0.15)), 4)
    robot = cf.Robot.from_strings(draft.urdf, draft.text())
    gaps = robot.gaps(robot.nominal.x[:robot.num_positions])
    return robot if min(gaps) > 1e-4 else None


def begin(draw: Callable[[int], Draft], seed: int, verdict: Verdict) -> Optional[Trial]:
    """The robot of this seed and its run; None, and a word in the counts, where there is none."""
    draft = draw(seed)
    try:
        robot = lowered(draft, np.random.default_rng([seed, 1]))
    except (ValueError, RuntimeError) as refusal:
        verdict.counts["robot refused"] += 1
        honest = ("degenerate", "do not move", "cannot have friction", "moves out of the plane")
        if not any(words in str(refusal) for words in honest):
            verdict.contradictions.append(f"refused: {refusal}")
        return None
    if robot is None:
        verdict.counts["no start"] += 1
        return None
    run = robot.simulate(robot.nominal.x, draft.duration, **OPTIONS)
    if not run.status.ok:
        verdict.counts[f"run: {run.status.outcome}"] += 1
        return None
    B = run.derivative(**DERIVATIVE)
    verdict.counts[f"derivative: {B.status.outcome}"] += 1
    return Trial(seed, draft, robot, run, B if B.status.ok else None, verdict)


def settled(quotients: List[np.ndarray], b: np.ndarray, noise: List[float]) -> str:
    """Whether quotients over falling steps agree with b: "right", "wrong", or "undecided". Those that agree with each other
    and not with b are wrong however near they are: what is 1e-5 off in one robot is not so little in another."""
    size = 1 + float(np.linalg.norm(b))
    errors = [float(np.linalg.norm(q - b)) for q in quotients]
    for k in range(len(quotients) - 2):
        change = max(float(np.linalg.norm(quotients[k] - quotients[k + 1])),
                     float(np.linalg.norm(quotients[k + 1] - quotients[k + 2])))
        if change + noise[k + 2] < 0.1 * errors[k + 2] and errors[k + 2] > 1e-7 * size:
            return "wrong"
    if min(errors) <= 1e-6 * size:
        return "right"
    falling = all(a > 1.5 * b for a, b in zip(errors[:4], errors[1:5]))
    return "right" if falling or min(errors) <= 1e-4 * size else "undecided"


def hold_against_quotients(verdict: Verdict, what: str, told: np.ndarray, stated: float, radius: float,
                           quotient: Callable[[float], Optional[np.ndarray]]) -> None:
    """What is told of one direction, with its stated error and radius, beside quotient(α) of runs, which is None where
    there is none, and raises ValueError where a start would leave a closed loop by α²."""
    quotients, noise = [], []
    for alpha in STEPS:
        try:
            found = quotient(alpha) if alpha <= radius else None
        except ValueError:
            verdict.counts[f"{what}: a start refused"] += 1
            continue
        if found is not None:
            quotients.append(found)
            noise.append(1e-11 * (1 + float(np.linalg.norm(told))) / alpha)
    if len(quotients) < 4:
        verdict.counts[f"{what} with a small radius"] += 1
        return
    word = settled(quotients, told, noise)
    error = min(float(np.linalg.norm(q - told)) for q in quotients)
    if word == "wrong" and error <= 3 * stated:
        word = "wrong as told"
    if word in ("right", "wrong"):
        verdict.weigh(what, word == "right", f"off by {error:.2e} of {np.linalg.norm(told):.2e}, stated {stated:.1e}, "
                                             f"radius {radius:.1e}")
    else:
        verdict.counts[f"{what} {word}"] += 1
