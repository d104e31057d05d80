# SPDX-License-Identifier: BSD-3-Clause
"""Random robots as text, from a seed: trees of links on a base, ground of every kind, at rest or moving, efforts of
every kind, limits, closures, controllers. Nothing in them is chosen for what is known of the code."""
import json
import math
from dataclasses import dataclass, field
from typing import Any, Dict, List, Tuple

import numpy as np


@dataclass
class Draft:
    """A robot to be: URDF by links and joints, and its YAML."""
    urdf: str
    yaml: Dict[str, Any]
    duration: float
    level: bool = False  # it falls without turning, its joints at rest
    coupled: List[Tuple[str, str, float]] = field(default_factory=list)  # a joint has the other's speed, times the number
    placed: bool = False  # it begins where it is, above whatever it will touch

    def text(self) -> str:
        """The YAML, as JSON, which is YAML, too."""
        return json.dumps(self.yaml)

    def copy(self) -> "Draft":
        """One that shares nothing with it."""
        return Draft(self.urdf, json.loads(self.text()), self.duration, self.level, self.coupled, self.placed)


def _numbers(values: Any) -> str:
    return " ".join(f"{value:.6g}" for value in values)


def _link(rng: np.random.Generator, name: str) -> str:
    mass = math.exp(rng.uniform(-1.5, 1))
    half = rng.uniform(0.05, 0.25, 3)  # of a box
    square = half ** 2
    inertia = mass / 3 * (square.sum() - square)
    return (f'<link name="{name}"><inertial><origin xyz="{_numbers(rng.uniform(-0.1, 0.1, 3))}"/>'
            f'<mass value="{mass:.6g}"/><inertia ixx="{inertia[0]:.6g}" iyy="{inertia[1]:.6g}" izz="{inertia[2]:.6g}" '
            'ixy="0" ixz="0" iyz="0"/></inertial></link>\n')


def _axis(rng: np.random.Generator, planar: bool) -> np.ndarray:
    if planar:
        return np.array([0, rng.choice([-1, 1]), 0])
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def _tree(rng: np.random.Generator, base: str, links: int) -> Any:
    """The URDF, and the names of its joints."""
    planar = base == "planar"
    parts = ['<link name="l0"/>\n' if base == "fixed" else _link(rng, "l0")]
    joints: List[str] = []
    for k in range(1, links + 1):
        slides = rng.random() < 0.2 and not planar
        parent = int(rng.integers(0, k)) if base != "fixed" or k > 1 else 0
        origin = rng.uniform(-0.3, 0.3, 3)
        if planar:
            origin[1] = 0
        parts.append(_link(rng, f"l{k}"))
        parts.append(f'<joint name="j{k}" type="{"prismatic" if slides else "revolute"}"><parent link="l{parent}"/>'
                     f'<child link="l{k}"/><origin xyz="{_numbers(origin)}"/><axis xyz="{_numbers(_axis(rng, planar))}"/>'
                     '<limit lower="-9" upper="9" effort="9" velocity="9"/></joint>\n')
        joints.append(f"j{k}")
    return f'<robot name="r">\n{"".join(parts)}</robot>', joints


def _times(rng: np.random.Generator, duration: float) -> List[float]:
    count = int(rng.integers(3, 7))
    return [round(float(t), 4) for t in np.cumsum(rng.uniform(0.05, 0.4, count)) * duration - 0.1]


def _reference(rng: np.random.Generator, duration: float, size: float) -> Dict[str, Any]:
    times = _times(rng, duration)
    values = [round(float(v), 4) for v in rng.uniform(-size, size, len(times))]
    reference: Dict[str, Any] = {"times": times, "values": values}
    if len(times) >= 4 and rng.random() < 0.3:
        values[-1] = values[0]
        reference["periodic"] = True
    return reference


def draw_reference(rng: np.random.Generator, duration: float, size: float) -> Dict[str, Any]:
    """A reference of an effort: a spline, or lines with blends."""
    reference = _reference(rng, duration, size)
    if rng.random() < 0.4:
        times = reference["times"]
        shortest = min(b - a for a, b in zip(times, times[1:]))
        reference.update(kind="blended", blend=round(float(rng.uniform(0.1, 0.6)) * shortest, 6))
    return reference


def _motion(rng: np.random.Generator, planar: bool, duration: float) -> Dict[str, Any]:
    direction = rng.normal(size=3)
    if planar:
        direction[1] = 0
    motion: Dict[str, Any] = {"direction": [round(float(d), 4) for d in direction]}
    kind = rng.integers(3)
    if kind == 0:
        motion["velocity"] = round(float(rng.uniform(-0.5, 0.5)), 4)
    elif kind == 1:
        motion.update(amplitude=round(float(rng.uniform(0.002, 0.02)), 5), frequency=round(float(rng.uniform(1, 5)), 3),
                      phase=round(float(rng.uniform(0, 6)), 3))
    else:
        motion.update(_reference(rng, duration, 0.02))
    return motion


def draw_ground(rng: np.random.Generator, planar: bool, duration: float) -> Dict[str, Any]:
    """What a contact may be above, here and there moving."""
    kind = rng.choice(["plane", "slope", "height_field", "height_map", "stairs", "box"])
    if kind == "plane":
        ground: Dict[str, Any] = {"kind": "plane"}
    elif kind == "slope":
        tilt = rng.normal(0, 0.15, 2)
        ground = {"kind": "plane", "normal": [round(float(tilt[0]), 4), 0 if planar else round(float(tilt[1]), 4), 1]}
    elif kind == "height_field":
        ground = {"kind": "height_field", "amplitude": 0.03, "wave_x": round(float(rng.uniform(1, 8)), 3),
                  "wave_y": 0 if planar else round(float(rng.uniform(-5, 5)), 3), "phase": round(float(rng.uniform(0, 6)), 3)}
    elif kind == "height_map":
        rows = [[round(float(h), 4) for h in rng.uniform(0, 0.05, 9)] for _ in range(2 if planar else 9)]
        if planar:
            rows[1] = rows[0]
        ground = {"kind": "height_map", "origin": [-0.93, -1.07], "step": [0.25, 2.0 if planar else 0.25],
                  "heights": rows}
    elif kind == "stairs":
        ground = {"kind": "stairs", "rise": round(float(rng.uniform(-0.06, 0.06)), 4), "run": 0.23, "riser": 0.11,
                  "first": -0.7, "last": 1}
    else:
        ground = {"kind": "box", "center": [0.1, 0, 0.05], "length": 0.7, "width": 4 if planar else 0.6, "height": 0.1,
                  "yaw": 0 if planar else 0.3, "riser": 0.15}
    if rng.random() < 0.3:
        ground["motion"] = _motion(rng, planar, duration)
    return ground


def _effort(rng: np.random.Generator, joint: str, duration: float) -> Dict[str, Any]:
    stiffness, damping = round(math.exp(rng.uniform(0, 6)), 3), round(math.exp(rng.uniform(-3, 1)), 3)
    kind = rng.choice(["joint_spring", "servo", "pd", "track"])
    effort: Dict[str, Any] = {"kind": str(kind), "joint": joint, "stiffness": stiffness, "damping": damping}
    if kind == "joint_spring":
        effort["rest"] = round(float(rng.uniform(-0.4, 0.4)), 3)
    if kind == "servo":
        effort["input"] = f"{joint}_setpoint"
    if kind == "pd":
        effort.update(position=f"{joint}_q", velocity=f"{joint}_v", feed_forward=f"{joint}_e")
    if kind == "track":
        effort.update(feed_forward=f"{joint}_e", reference=draw_reference(rng, duration, 0.5))
    if kind != "joint_spring" and rng.random() < 0.4:
        effort["limit"] = round(math.exp(rng.uniform(0, 3)), 3)
    return effort


def _point(rng: np.random.Generator, planar: bool) -> List[float]:
    point = rng.uniform(-0.3, 0.3, 3)
    if planar:
        point[1] = 0
    return [round(float(p), 4) for p in point]


def draw(seed: int) -> Draft:
    """The robot of this seed, above its ground by an unknown height."""
    rng = np.random.default_rng(seed)
    base = str(rng.choice(["floating", "planar", "fixed"], p=[0.4, 0.4, 0.2]))
    planar = base == "planar"
    links = int(rng.integers(1 if base == "fixed" else 0, 4))
    urdf, joints = _tree(rng, base, links)
    duration = round(float(rng.uniform(0.25, 0.9)), 3)
    yaml: Dict[str, Any] = {"base": base, "constraints": {}, "efforts": {}}
    bodies = [f"l{k}" for k in range(1 if base == "fixed" else 0, links + 1)]
    law: Dict[str, float] = {}
    if rng.random() < 0.6:
        law["friction"] = round(float(rng.uniform(0.1, 1.3)), 3)
    if rng.random() < 0.3:
        law["restitution"] = round(float(rng.uniform(0.1, 0.8)), 3)
    grounds = [draw_ground(rng, planar, duration) for _ in range(1 + int(rng.random() < 0.3))]
    for k in range(int(rng.integers(1, 5))):
        yaml["constraints"][f"c{k}"] = {"link": str(rng.choice(bodies)), "point": _point(rng, planar),
                                        **grounds[k % len(grounds)], **law}
    for joint in joints:
        if rng.random() < 0.7:
            yaml["efforts"][f"e_{joint}"] = _effort(rng, joint, duration)
        if rng.random() < 0.2:
            yaml["constraints"][f"stop_{joint}"] = {"kind": "upper_limit", "joint": joint,
                                                    "upper": round(float(rng.uniform(0.1, 0.6)), 3)}
    if rng.random() < 0.2:
        yaml["efforts"]["gust"] = {"kind": "timed_force", "link": str(rng.choice(bodies)), "point": _point(rng, planar),
                                   "force": [round(float(f), 3) for f in rng.normal(0, 8, 3)],
                                   "reference": draw_reference(rng, duration, 1)}
    if rng.random() < 0.2:
        yaml["efforts"]["air"] = {"kind": "drag", "link": str(rng.choice(bodies)), "point": _point(rng, planar),
                                  "linear": 0.3, "quadratic": 0.2}
    if joints and rng.random() < 0.2:
        yaml["gravity_compensation"] = {"joints": "all", "share": round(float(rng.uniform(0, 1)), 3)}
    positions = {joint: round(float(rng.uniform(-0.5, 0.5)), 4) for joint in joints}
    for joint in joints:
        if f"stop_{joint}" in yaml["constraints"]:
            positions[joint] = round(float(yaml["constraints"][f"stop_{joint}"]["upper"] - rng.uniform(0.02, 0.5)), 4)
    yaml["nominal"] = {"positions": positions, "velocities": {}}
    brakes = [joint for joint in joints if rng.random() < 0.15]
    for joint in brakes:
        start = urdf.index(f'<joint name="{joint}"')
        at = urdf.index("</joint>", start)
        urdf = f'{urdf[:at]}<dynamics friction="{rng.uniform(0.05, 3):.4g}"/>{urdf[at:]}'
    if brakes:
        yaml["joints"] = {"friction": brakes}
    return Draft(urdf, yaml, duration)
