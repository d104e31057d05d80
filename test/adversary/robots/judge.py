# SPDX-License-Identifier: BSD-3-Clause
"""Holds what a run and its derivative tell against runs beside it, which know nothing of derivatives."""
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, List, Optional

import numpy as np

import contact_flow as cf
from generate import Draft, draw

TOLERANCE = 1e-12
OPTIONS = dict(relative_tolerance=TOLERANCE, absolute_tolerance=TOLERANCE, max_seconds=20)
DERIVATIVE = dict(tolerance=1e-10, max_seconds=30)
STEPS = [10.0 ** -k for k in np.arange(3, 8.5, 0.5)]


@dataclass
class Verdict:
    """Of one robot: the words of its counts, and what contradicts it."""
    counts: Counter = field(default_factory=Counter)
    contradictions: List[str] = field(default_factory=list)


def lowered(draft: Draft, rng: np.random.Generator) -> Optional[cf.Robot]:
    """The robot with a start whose contacts are above the ground, the lowest by a little; None where it has none."""
    nominal = draft.yaml["nominal"]
    if draft.yaml["base"] != "fixed":
        nominal["positions"]["base_z"] = 1.5
    robot = cf.Robot.from_strings(draft.urdf, draft.text())
    for name in robot.velocities:
        if name != "clock":
            nominal["velocities"][name] = round(float(rng.normal(0, 0.7)), 4)
    if draft.yaml["base"] == "fixed":  # the ground comes to the robot
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
    else:
        gaps = robot.gaps(robot.nominal.x[:robot.num_positions])
        low = min(gap for name, gap in zip(robot.constraints, gaps) if name.startswith("c"))
        nominal["positions"]["base_z"] = round(float(1.5 - 0.97 * low + rng.uniform(0.01, 0.15)), 4)
    robot = cf.Robot.from_strings(draft.urdf, draft.text())
    gaps = robot.gaps(robot.nominal.x[:robot.num_positions])
    return robot if min(gaps) > 1e-4 else None


def settled(quotients: List[np.ndarray], b: np.ndarray, noise: List[float]) -> str:
    """Whether quotients over falling steps agree with b: "right", "wrong", or "undecided"."""
    size = 1 + float(np.linalg.norm(b))
    errors = [float(np.linalg.norm(q - b)) for q in quotients]
    if min(errors) <= 1e-6 * size:
        return "right"
    for k in range(len(quotients) - 2):
        change = max(float(np.linalg.norm(quotients[k] - quotients[k + 1])),
                     float(np.linalg.norm(quotients[k + 1] - quotients[k + 2])))
        if change + noise[k + 2] < 0.1 * errors[k + 2] and errors[k + 2] > 1e-4 * size:
            return "wrong"
    falling = all(a > 1.5 * b for a, b in zip(errors[:4], errors[1:5]))
    return "right" if falling or min(errors) <= 1e-4 * size else "undecided"


def try_direction(robot: cf.Robot, B: Any, end: np.ndarray, draft: Draft, w: np.ndarray, verdict: Verdict,
                  what: str) -> None:
    """One direction of a derivative beside quotients."""
    try:
        b = B(w)
        stated = float(np.linalg.norm(B.error(w)))
        radius = float(B.radius(w))
    except (ValueError, RuntimeError):
        verdict.counts["direction refused"] += 1
        return
    quotients, noise = [], []
    x = robot.nominal.x
    for alpha in STEPS:
        if alpha > radius:
            continue
        run = robot.simulate(robot.perturb(x, alpha * w), draft.duration, **OPTIONS)
        if not run.status.ok:
            continue
        quotients.append(robot.separation(run.final_state, end) / alpha)
        noise.append(1e-10 * (1 + float(np.linalg.norm(b))) / alpha)
    if len(quotients) < 4:
        verdict.counts["direction with a small radius"] += 1
        return
    word = settled(quotients, b, noise)
    error = min(float(np.linalg.norm(q - b)) for q in quotients)
    if word == "wrong" and error <= 3 * stated:
        word = "wrong as told"
    verdict.counts[f"direction {word}"] += 1
    if word == "wrong":
        verdict.contradictions.append(f"{what}: off by {error:.2e} of {np.linalg.norm(b):.2e}, stated {stated:.1e}, "
                                      f"radius {radius:.1e}, direction {w.tolist()}")


def try_chain(robot: cf.Robot, B: Any, run: Any, draft: Draft, rng: np.random.Generator, verdict: Verdict) -> None:
    """B of the whole beside B of two halves, where neither has kinks."""
    at = draft.duration * float(rng.uniform(0.2, 0.8))
    if any(abs(event.t - at) < 1e-4 for event in run.events):
        return
    first = robot.simulate(robot.nominal.x, at, **OPTIONS)
    second = robot.simulate(first.final_state, draft.duration - at, **OPTIONS)
    if not (first.status.ok and second.status.ok) or second.arcs[0].word != first.arcs[-1].word:
        return
    before, after = first.derivative(**DERIVATIVE), second.derivative(**DERIVATIVE)
    if not (before.status.ok and after.status.ok):
        return
    try:
        w = rng.normal(size=2 * robot.dof)
        whole, parts = B(w), after(after.project(before(w)))
    except (ValueError, RuntimeError):
        return
    error = float(np.linalg.norm(whole - parts)) / (1 + float(np.linalg.norm(whole)))
    stated = float(np.linalg.norm(B.error(w))) / (1 + float(np.linalg.norm(whole)))
    verdict.counts["chain right" if error <= 1e-6 + 3 * stated else "chain wrong"] += 1
    if error > 1e-6 + 3 * stated:
        verdict.contradictions.append(f"chain rule at {at}: off by {error:.2e}, stated {stated:.1e}")


def try_units(draft: Draft, run: Any, B: Any, w: np.ndarray, verdict: Verdict) -> None:
    """The run and one direction beside those of the same robot in other units of mass."""
    b, stated = B(w), float(np.linalg.norm(B.error(w)))
    for unit in (2.0 ** -30, 2.0 ** 15):
        scaled = draft.in_masses(unit)
        robot = cf.Robot.from_strings(scaled.urdf, scaled.text())
        other = robot.simulate(robot.nominal.x, draft.duration, **OPTIONS)
        derivative = other.derivative(**DERIVATIVE) if other.status.ok else None
        if derivative is None or not derivative.status.ok:
            verdict.counts["unit of mass with another outcome"] += 1
            continue
        apart = float(np.linalg.norm(other.final_state - run.final_state))
        error = float(np.linalg.norm(derivative(w) - b))
        told = 3 * (stated + float(np.linalg.norm(derivative.error(w))))
        right = apart <= 1e-7 and error <= min(1e-4, 1e-6 + told) * (1 + float(np.linalg.norm(b)))
        verdict.counts["unit of mass right" if right else "unit of mass wrong"] += 1
        if not right:
            verdict.contradictions.append(f"1 kg = {unit}: states {apart:.2e} apart, derivatives {error:.2e} of "
                                          f"{np.linalg.norm(b):.2e}, told {told / 3:.1e}")


def judge(seed: int) -> Verdict:
    """The robot of this seed, held against runs beside it."""
    verdict = Verdict()
    rng = np.random.default_rng([seed, 1])
    draft = draw(seed)
    try:
        robot = lowered(draft, rng)
    except (ValueError, RuntimeError) as refusal:
        verdict.counts["robot refused"] += 1
        honest = ("degenerate", "do not move", "cannot have friction")
        if not any(words in str(refusal) for words in honest):
            verdict.contradictions.append(f"refused: {refusal}")
        return verdict
    if robot is None:
        verdict.counts["no start"] += 1
        return verdict
    run = robot.simulate(robot.nominal.x, draft.duration, **OPTIONS)
    if not run.status.ok:
        verdict.counts[f"run: {run.status.outcome}"] += 1
        return verdict
    B = run.derivative(**DERIVATIVE)
    if not B.status.ok:
        verdict.counts[f"derivative: {B.status.outcome}"] += 1
        return verdict
    verdict.counts["derivative ok"] += 1
    n = 2 * robot.dof
    for k in range(3):
        w = rng.normal(size=n) if k else np.eye(n)[int(rng.integers(robot.dof))]
        if "clock" in robot.velocities:
            w[robot.dof + robot.velocities.index("clock")] = 0  # its rate is 1
        w = w / np.linalg.norm(w)
        for sign in (1, -1):
            try_direction(robot, B, run.final_state, draft, sign * w, verdict, f"direction {k}{'+-'[sign < 0]}")
    try_chain(robot, B, run, draft, rng, verdict)
    try:
        w = rng.normal(size=n)
        try_units(draft, run, B, w / np.linalg.norm(w), verdict)
    except (ValueError, RuntimeError):
        verdict.counts["unit of mass refused"] += 1
    return verdict


def main() -> int:
    """judge.py FIRST COUNT [SECONDS]"""
    first, count = int(sys.argv[1]), int(sys.argv[2])
    budget = float(sys.argv[3]) if len(sys.argv) > 3 else 1e9
    begin, counts, wrong, done = time.process_time(), Counter(), 0, 0
    for seed in range(first, first + count):
        if time.process_time() - begin > budget:
            break
        verdict = judge(seed)
        counts += verdict.counts
        done += 1
        for line in verdict.contradictions:
            wrong += 1
            print(f"robot {seed}: {line}", flush=True)
        if done % 20 == 0:
            print(f"{done} of {count} robots, {wrong} contradictions, {time.process_time() - begin:.0f} s",
                  file=sys.stderr, flush=True)
    print(f"{done} robots from {first} on, {wrong} contradictions")
    for words, number in sorted(counts.items()):
        print(f"  {number:6d} {words}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
