# SPDX-License-Identifier: BSD-3-Clause
"""The same robot told otherwise: contacts and efforts in another order, a world turned about the vertical or moved by some
hundred metres, runs side by side in lanes. What comes out may differ by rounding, lanes not at all."""
import math
from typing import Any, Callable, Optional, Sequence

import numpy as np

import contact_flow as cf
from generate import Draft
from trial import DERIVATIVE, OPTIONS, Trial, error_of

APART = 1e-7  # of states, times their size


def in_reverse(draft: Draft) -> Draft:
    """Contacts and efforts in the opposite order."""
    other = draft.copy()
    for part in ("constraints", "efforts"):
        other.yaml[part] = dict(reversed(list(other.yaml[part].items())))
    return other


def turned(vector: Sequence[float], angle: float) -> np.ndarray:
    """(x, y, …) turned about z."""
    c, s = math.cos(angle), math.sin(angle)
    x, y = vector[0], vector[1]
    return np.array([c * x - s * y, s * x + c * y, *vector[2:]])


def turned_world(draft: Draft, angle: float) -> Optional[Draft]:
    """All that is fixed in the world, turned; None where its description has no room for that."""
    other = draft.copy()
    for constraint in other.yaml["constraints"].values():
        kind = constraint["kind"]
        if kind == "height_map":  # its rows run along x
            return None
        if kind == "plane" and "normal" in constraint:
            constraint["normal"] = turned(constraint["normal"], angle).tolist()
        if constraint.get("link") == "world":
            constraint.update(point=turned(constraint["point"], angle).tolist())
        if constraint.get("other_link") == "world":
            constraint.update(other_point=turned(constraint["other_point"], angle).tolist(),
                              normal=turned(constraint["normal"], angle).tolist())
        if kind == "height_field":
            wave = turned([constraint["wave_x"], constraint["wave_y"]], angle)
            constraint.update(wave_x=wave[0], wave_y=wave[1])
        if kind == "stairs":
            constraint["direction"] = turned([1, 0, 0], angle).tolist()
        if kind == "box":
            constraint.update(center=turned(constraint["center"], angle).tolist(), yaw=constraint["yaw"] + angle)
        if "motion" in constraint:
            constraint["motion"]["direction"] = turned(constraint["motion"]["direction"], angle).tolist()
    for effort in other.yaml["efforts"].values():
        if "force" in effort:
            effort["force"] = turned(effort["force"], angle).tolist()
    return other


def moved_world(draft: Draft, move: Sequence[float]) -> Draft:
    """All that is fixed in the world, moved along x and y."""
    other = draft.copy()
    x, y = move
    for constraint in other.yaml["constraints"].values():
        kind = constraint["kind"]
        if kind == "plane" and "normal" in constraint:
            normal = np.array(constraint["normal"], float)
            unit = normal / np.linalg.norm(normal)
            constraint["offset"] = constraint.get("offset", 0) + float(unit[0] * x + unit[1] * y)
        for link, point in (("link", "point"), ("other_link", "other_point")):
            if constraint.get(link) == "world":
                constraint[point] = [constraint[point][0] + x, constraint[point][1] + y, constraint[point][2]]
        if kind == "height_field":
            constraint["phase"] -= constraint["wave_x"] * x + constraint["wave_y"] * y
        if kind == "height_map":
            constraint["origin"] = [constraint["origin"][0] + x, constraint["origin"][1] + y]
        if kind == "stairs":
            constraint.update(first=constraint["first"] + x, last=constraint["last"] + x)
        if kind == "box":
            constraint["center"] = [constraint["center"][0] + x, constraint["center"][1] + y, constraint["center"][2]]
    return other


def moved_state(robot: cf.Robot, x: np.ndarray, move: Sequence[float]) -> np.ndarray:
    """The state of a base that is not fixed, moved."""
    z = np.array(x, float)
    for name, by in zip(("base_x", "base_y"), move):
        if name in robot.state_names:
            z[robot.state_names.index(name)] += by
    return z


def turned_state(robot: cf.Robot, x: np.ndarray, angle: float) -> np.ndarray:
    """The state of a floating base in the turned world: position, orientation and linear velocity are the world's."""
    y = np.array(x, float)
    y[:3] = turned(y[:3], angle)
    w, i, j, k = y[3:7]
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    y[3:7] = [c * w - s * k, c * i - s * j, c * j + s * i, c * k + s * w]
    v = robot.num_positions
    y[v:v + 3] = turned(y[v:v + 3], angle)
    return y


def turned_tangent(robot: cf.Robot, w: np.ndarray, angle: float) -> np.ndarray:
    """(δq, δv): turns are those of the body, moves are the world's."""
    turn, d = np.array(w, float), robot.dof
    turn[:3], turn[d:d + 3] = turned(turn[:3], angle), turned(turn[d:d + 3], angle)
    return turn


def hold(trial: Trial, what: str, draft: Draft, there: Callable[[np.ndarray], np.ndarray],
         back: Callable[[np.ndarray], np.ndarray], tangent: Callable[[np.ndarray], np.ndarray],
         tangent_back: Callable[[np.ndarray], np.ndarray]) -> None:
    """The run and one direction of the robot told otherwise, beside those of the trial."""
    verdict, w = trial.verdict, trial.direction(trial.random(31))
    robot = cf.Robot.from_strings(draft.urdf, draft.text())
    run = robot.simulate(there(trial.robot.nominal.x), draft.duration, **OPTIONS)
    if not run.status.ok:
        verdict.weigh(what, run.status.outcome == "budget exceeded", run.status.message)
        return
    end = trial.run.final_state
    apart = float(np.linalg.norm(back(run.final_state) - end))
    verdict.weigh(what, apart <= APART * (1 + float(np.linalg.norm(end))), f"states {apart:.2e} apart")
    B = run.derivative(**DERIVATIVE)
    if B.status.ok != (trial.derivative is not None):
        verdict.counts[f"{what}: one of two has a derivative, {B.status.outcome}"] += 1
    if not B.status.ok or trial.derivative is None:
        return
    try:
        b, other = trial.derivative(w), tangent_back(B(tangent(w)))
        stated = float(np.linalg.norm(error_of(trial.derivative, w)) + np.linalg.norm(error_of(B, tangent(w))))
    except (ValueError, RuntimeError):
        return
    error, size = float(np.linalg.norm(other - b)), 1 + float(np.linalg.norm(b))
    verdict.weigh(f"derivative, {what}", error <= 3 * stated + APART * size,
                  f"{error:.2e} of {size - 1:.2e} apart, stated {stated:.1e}")


def try_lanes(trial: Trial) -> None:
    """States of a batch beside single runs, bit by bit."""
    robot, rng = trial.robot, trial.random(32)
    options = {key: value for key, value in OPTIONS.items() if key != "max_seconds"}
    states = [robot.nominal.x] + [robot.perturb(robot.nominal.x, 1e-2 * trial.direction(rng)) for _ in range(4)]
    try:
        batch = robot.simulate_batch(np.array(states), trial.draft.duration, **options)
    except (ValueError, RuntimeError):
        trial.verdict.counts["lanes refused"] += 1  # a start below the ground
        return
    for k, state in enumerate(states):
        try:
            alone = robot.simulate(state, trial.draft.duration, **options)
        except ValueError as refusal:  # a gear that does not mesh
            trial.verdict.weigh("lanes", batch.outcome[k] == "refused", f"state {k} alone: {refusal}")
            continue
        if alone.status.ok:
            same = bool(np.array_equal(alone.final_state, batch.final_state[k]))
            trial.verdict.weigh("lanes", same, f"state {k}")


def judge(trial: Trial) -> None:
    """Another order, a turned and a moved world where the base is not fixed, and lanes."""
    def same(value: Any) -> Any:
        return value

    hold(trial, "another order", in_reverse(trial.draft), same, same, same, same)
    if trial.draft.yaml["base"] == "floating":
        angle = float(trial.random(33).uniform(-3, 3))
        draft, robot = turned_world(trial.draft, angle), trial.robot
        if draft is not None:
            hold(trial, "turned world", draft,
                 lambda x: turned_state(robot, x, angle), lambda x: turned_state(robot, x, -angle),
                 lambda w: turned_tangent(robot, w, angle), lambda w: turned_tangent(robot, w, -angle))
    if trial.draft.yaml["base"] != "fixed":
        rng, robot = trial.random(34), trial.robot
        move = [float(rng.choice([-1, 1])) * 10 ** float(rng.uniform(1, 3)), 0.0]
        if trial.draft.yaml["base"] == "floating":
            move[1] = float(rng.normal(0, 300))
        hold(trial, "moved world", moved_world(trial.draft, move), lambda x: moved_state(robot, x, move),
             lambda x: moved_state(robot, x, [-move[0], -move[1]]), same, same)
    try_lanes(trial)
