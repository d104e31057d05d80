# SPDX-License-Identifier: BSD-3-Clause
"""The same robot in other units of mass, length and time: of a gram, of a hundred metres, of milliseconds. Its numbers move
as before, in the other units. Powers of two round nothing."""
import re
from dataclasses import dataclass
from typing import Any, Dict, List

import numpy as np

import contact_flow as cf
from generate import Draft
from trial import AT_REST, DERIVATIVE, OPTIONS, TOLERANCE, Trial, error_of

NUMBER = re.compile(r"[-+.\deE]+")
APART = 1e-6  # of states and derivatives, times their size
# Exponents of mass, length and time of a key's value; those of an element of a joint are of a joint that slides, and of a
# joint that turns with a length squared more.
ELEMENT = {
    "point": (0, 1, 0), "other_point": (0, 1, 0), "offset": (0, 1, 0), "height": (0, 1, 0), "amplitude": (0, 1, 0),
    "wave_x": (0, -1, 0), "wave_y": (0, -1, 0), "origin": (0, 1, 0), "step": (0, 1, 0), "heights": (0, 1, 0),
    "rise": (0, 1, 0), "run": (0, 1, 0), "riser": (0, 1, 0), "first": (0, 1, 0), "last": (0, 1, 0), "center": (0, 1, 0),
    "length": (0, 1, 0), "width": (0, 1, 0), "radius": (0, 1, 0), "other_radius": (0, 1, 0), "frequency": (0, 0, -1),
    "velocity": (0, 1, -1), "values": (0, 1, 0), "times": (0, 0, 1), "blend": (0, 0, 1), "force": (1, 1, -2),
    "linear": (1, 0, -1), "quadratic": (1, -1, 0), "stiffness": (1, 0, -2), "damping": (1, 0, -1), "mass": (1, 0, 0),
    "turn_stiffness": (1, 2, -2), "turn_damping": (1, 2, -1)}
SLIDING = {"rest": (0, 1, 0), "lower": (0, 1, 0), "upper": (0, 1, 0), "limit": (1, 1, -2), "stall": (1, 1, -2),
           "speed": (0, 1, -1), "stiffness": (1, 0, -2), "damping": (1, 0, -1), "values": (0, 1, 0), "times": (0, 0, 1),
           "blend": (0, 0, 1)}
TURNING = {"rest": (0, 0, 0), "lower": (0, 0, 0), "upper": (0, 0, 0), "limit": (1, 2, -2), "stall": (1, 2, -2),
           "speed": (0, 0, -1), "stiffness": (1, 2, -2), "damping": (1, 2, -1), "values": (0, 0, 0), "times": (0, 0, 1),
           "blend": (0, 0, 1)}
BASE = ("base_x", "base_y", "base_z")
FACTOR = {"times": (0, 0, 1), "blend": (0, 0, 1), "values": (0, 0, 0)}  # of a reference that multiplies


@dataclass
class Units:
    """The numbers of 1 kg, 1 m and 1 s."""
    mass: float
    length: float
    time: float

    def of(self, exponents: Any) -> float:
        """The number of 1 kg^a m^b s^c."""
        a, b, c = exponents
        return self.mass ** a * self.length ** b * self.time ** c

    def scaled(self, value: Any, exponents: Any) -> Any:
        """A number, or lists of them."""
        return [self.scaled(v, exponents) for v in value] if isinstance(value, list) else value * self.of(exponents)

    def convert(self, element: Dict[str, Any], table: Dict[str, Any]) -> None:
        """The numbers of an element of the YAML whose keys are in the table, and of its motion or reference."""
        for key, value in element.items():
            if key == "motion":
                self.convert(value, ELEMENT)
            elif key == "reference":
                self.convert(value, table if "joint" in element else FACTOR)
            elif key in table:
                element[key] = self.scaled(value, table[key])


def slides(draft: Draft, name: str) -> bool:
    """Whether a coordinate of the base, of a link that floats or slides in a plane, of a sole or of a joint is a length."""
    free = name[-2:] in ("_x", "_y", "_z") and re.search(f'<joint name="{name[:-2]}" type="(floating|planar)"', draft.urdf)
    return name in BASE or bool(free) or "_sole_" in name or f'<joint name="{name}" type="prismatic"' in draft.urdf


def urdf_in(units: Units, draft: Draft) -> str:
    """Its URDF in these units."""
    text = draft.urdf

    def replace(pattern: str, exponents: Any, part: str) -> str:
        return re.sub(pattern, lambda match: match[1] + " ".join(
            repr(float(number) * units.of(exponents)) for number in match[2].split()) + '"', part)

    text = replace(r'(<origin xyz=")([^"]*)"', (0, 1, 0), text)
    text = replace(r'(<box size=")([^"]*)"', (0, 1, 0), text)
    text = replace(r'(<mass value=")([^"]*)"', (1, 0, 0), text)
    text = replace(r'(\bi[xyz][xyz]=")([^"]*)"', (1, 2, 0), text)
    parts = re.split(r"(?=<joint )", text)
    for k, part in enumerate(parts):
        if not part.startswith("<joint "):
            continue
        name = part.split('"')[1]
        table = SLIDING if slides(draft, name) else TURNING
        for key, like in (("lower", "lower"), ("upper", "lower"), ("effort", "limit"), ("velocity", "speed"),
                          ("friction", "limit"), ("offset", "rest")):
            part = replace(rf'(\b{key}=")([^"]*)"', table[like], part)
        coupled = [other for joint, other, _ in draft.coupled if joint == name]
        if coupled:
            ratio = length_of(draft, name) - length_of(draft, coupled[0])
            part = replace(r'(\bmultiplier=")([^"]*)"', (0, ratio, 0), part)
        parts[k] = part
    return "".join(parts)


def length_of(draft: Draft, name: str) -> int:
    """The exponent of length of a joint's coordinate."""
    return 1 if slides(draft, name) else 0


def draft_in(units: Units, draft: Draft) -> Draft:
    """The same robot in these units."""
    other = draft.copy()
    other.urdf = urdf_in(units, draft)
    other.duration = draft.duration * units.time
    yaml = other.yaml
    yaml["gravity"] = yaml.get("gravity", 9.81) * units.of((0, 1, -2))
    for element in [*yaml["constraints"].values(), *yaml["efforts"].values(), *yaml.get("soles", {}).values()]:
        table = ELEMENT
        if "joint" in element:
            table = SLIDING if slides(draft, element["joint"]) else TURNING
        units.convert(element, table)
    for joint, inertia in yaml.get("joints", {}).get("armature", {}).items():
        yaml["joints"]["armature"][joint] = inertia * units.of((1, 0 if slides(draft, joint) else 2, 0))
    for closure in yaml.get("closures", {}).values():
        if "joint" not in closure:  # of points
            units.convert(closure, ELEMENT)
            continue
        joint, second = length_of(draft, closure["joint"]), length_of(draft, closure["other_joint"])
        closure["multiplier"] *= units.length ** (joint - second)
        closure["offset"] *= units.length ** joint
    joint_of = {effort["input"]: effort["joint"] for effort in yaml["efforts"].values() if "input" in effort}
    for name, gains in yaml.get("feedback", {}).get("gains", {}).items():
        driven = length_of(draft, joint_of[name])
        for part, by_time in (("positions", 0), ("velocities", 1)):
            for joint in gains.get(part, {}):
                gains[part][joint] *= units.of((0, driven - length_of(draft, joint), by_time))
    for name in yaml["nominal"].get("inputs", {}):  # forces of slides
        yaml["nominal"]["inputs"][name] *= units.of((1, 1, -2))
    for part, by_time in (("positions", 0), ("velocities", -1)):
        for joint in yaml["nominal"].get(part, {}):
            yaml["nominal"][part][joint] *= units.of((0, length_of(draft, joint), by_time))
    return other


def lengths(draft: Draft, names: List[str]) -> np.ndarray:
    """Exponents of length of coordinates."""
    return np.array([length_of(draft, name) for name in names])


def hold(trial: Trial, units: Units, tolerance: float = TOLERANCE) -> None:
    """The run and one direction beside those of the same robot in these units."""
    verdict, draft = trial.verdict, draft_in(units, trial.draft)
    word = f"1 kg = {units.mass:.3g}, 1 m = {units.length:.3g}, 1 s = {units.time:.3g}"
    robot = cf.Robot.from_strings(draft.urdf, draft.text())
    turns, rates = np.array(robot.state_names[:robot.num_positions]), np.array(robot.velocities)
    position = units.length ** lengths(trial.draft, list(turns)) * np.where(turns == "clock", units.time, 1.0)
    velocity = units.length ** lengths(trial.draft, list(rates)) * np.where(rates == "clock", units.time, 1.0)
    state, tangent = np.append(position, velocity / units.time), np.append(velocity, velocity / units.time)
    speed = units.length / units.time
    options = dict(OPTIONS, absolute_tolerance=max(1e-15, tolerance * min(1, units.length, speed, 1 / units.time)),
                   gap_tolerance=1e-9 * units.length, speed_tolerance=1e-6 * speed)
    x = robot.nominal.x
    verdict.weigh("start in units", bool(np.allclose(x / state, trial.robot.nominal.x, 1e-14, 0)), f"{word}: {x / state}")
    run = robot.simulate(x, draft.duration, **options)
    if not run.status.ok:
        verdict.counts[f"units: {run.status.outcome}"] += 1  # times are short beside 1 s
        return
    B = run.derivative(**DERIVATIVE)
    end = trial.run.final_state
    apart, size = float(np.linalg.norm(run.final_state / state - end)), 1 + float(np.linalg.norm(end))
    if B.status.ok and trial.derivative is not None:
        told = np.linalg.norm(trial.derivative.trust.state_error) + np.linalg.norm(B.trust.state_error / tangent)
        known = APART * size + 3 * float(told)
    else:  # bounces that are made rest, of which one run follows more
        known = AT_REST * size
    verdict.weigh("units", apart <= known, f"{word}: states {apart:.2e} apart")
    if B.status.ok != (trial.derivative is not None):
        verdict.counts[f"units: one of two has a derivative, {B.status.outcome}"] += 1
    if not B.status.ok or trial.derivative is None:
        return
    w = trial.direction(trial.random(81))
    try:
        b, other = trial.derivative(w), B(tangent * w) / tangent
        stated = float(np.linalg.norm(error_of(trial.derivative, w)) + np.linalg.norm(error_of(B, tangent * w) / tangent))
    except (ValueError, RuntimeError):
        verdict.counts["direction in units refused"] += 1
        return
    stated += trial.derivative.trust.derivative_error  # bounces of which one run follows more, too
    error, size = float(np.linalg.norm(other - b)), 1 + float(np.linalg.norm(b))
    verdict.weigh("derivative, units", error <= APART * size + 3 * stated,
                  f"{word}: {error:.2e} of {size - 1:.2e} apart, stated {stated:.1e}")


def judge(trial: Trial) -> None:
    """Other units of each alone, and of all."""
    rng = trial.random(80)
    masses, metres, seconds = 2.0 ** rng.integers(-30, 16), 2.0 ** rng.integers(-12, 9), 2.0 ** rng.integers(-10, 7)
    choices = [Units(masses, 1, 1), Units(1, metres, 1), Units(1, 1, seconds), Units(masses, metres, seconds)]
    own_speed = any(effort["kind"] == "drag" for effort in trial.draft.yaml["efforts"].values())  # below which it is smooth
    for units in choices:
        if not own_speed or units.length / units.time >= 1 / 16:
            hold(trial, units)
