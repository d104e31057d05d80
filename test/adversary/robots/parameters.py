# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives by numbers of a robot (masses, inertias, gravity, whatever its YAML gives a number) and by its inputs,
beside quotients of robots that were loaded with another number."""
import json
from typing import Any, Dict, List

import numpy as np

import contact_flow as cf
from trial import DERIVATIVE, OPTIONS, Trial, error_of, hold_against_quotients

NUMBERS = 4  # of a robot, by which its outcome is differentiated


def candidates(trial: Trial, rng: np.random.Generator) -> List[str]:
    """Names that may be numbers of the robot, in random order."""
    names = ["gravity"]
    for link in (line.split('"')[1] for line in trial.draft.urdf.split("\n") if line.startswith("<link")):
        names += [f"links/{link}/{key}" for key in ("mass", "x", "y", "z", "ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
    for part in ("constraints", "efforts"):
        for name, element in trial.draft.yaml[part].items():
            for key, value in element.items():
                if isinstance(value, (int, float)) and not isinstance(value, bool):
                    names.append(f"{name}/{key}")
                if isinstance(value, list):
                    names += [f"{name}/{key}_{axis}" for axis in "xyz"]
    return [str(name) for name in rng.permutation(list(dict.fromkeys(names)))]


def with_parameters(trial: Trial, numbers: List[str]) -> str:
    """The YAML in which p0, p1, … are these numbers."""
    parameters: Dict[str, Any] = {f"p{k}": number for k, number in enumerate(numbers)}
    return json.dumps({**trial.draft.yaml, "parameters": parameters})


def judge(trial: Trial) -> None:
    """By some numbers and all inputs, up and down."""
    verdict, rng, urdf = trial.verdict, trial.random(7), trial.draft.urdf
    numbers: List[str] = []
    for name in candidates(trial, rng):
        if len(numbers) == NUMBERS:
            break
        try:
            cf.Robot.from_strings(urdf, with_parameters(trial, numbers + [name]))
            numbers.append(name)
        except ValueError:
            verdict.counts["no parameter"] += 1
    text = with_parameters(trial, numbers)
    robot = cf.Robot.from_strings(urdf, text)
    run = robot.simulate(robot.nominal.x, trial.draft.duration, **OPTIONS)
    if not run.status.ok:
        verdict.counts[f"run with parameters: {run.status.outcome}"] += 1
        return
    by = [f"p{k}" for k in range(len(numbers))] + (["inputs"] if robot.inputs else [])
    B = run.derivative(by=by, **DERIVATIVE)
    verdict.counts[f"by parameters: {B.status.outcome}"] += 1
    if not B.status.ok:
        return

    def moved(name: str, change: float) -> Any:
        if name in robot.inputs:
            inputs = np.array(robot.nominal.u, float)
            inputs[robot.inputs.index(name)] += change
            return robot.simulate(robot.nominal.x, trial.draft.duration, inputs=inputs, **OPTIONS)
        other = cf.Robot.from_strings(urdf, text, **{**robot.parameters, name: robot.parameters[name] + change})
        return other.simulate(other.nominal.x, trial.draft.duration, **OPTIONS)

    for name in by[:len(numbers)] + list(robot.inputs):
        for sign in "+-":
            try:
                b, stated = B(sign + name), float(np.linalg.norm(error_of(B, sign + name)))
                radius = float(B.radius(sign + name))
            except (ValueError, RuntimeError):
                verdict.counts["parameter refused"] += 1
                continue

            def quotient(alpha: float) -> Any:
                try:
                    run_beside = moved(name, alpha if sign == "+" else -alpha)
                except (ValueError, RuntimeError):  # a number out of its range
                    return None
                apart = robot.separation(run_beside.final_state, run.final_state)
                return apart / alpha if run_beside.status.ok else None

            what = "input" if name in robot.inputs else "parameter " + numbers[int(name[1:])].split("/")[-1]
            hold_against_quotients(verdict, what, b, stated, radius, quotient)
