# SPDX-License-Identifier: BSD-3-Clause
"""Random things to be handled, from a seed: free boxes and balls in a row or on top of each other, on ground that may move,
fingers that press, grasp and lift them, in a plane and in space. What touches belongs to two bodies that both move."""
import math
from typing import Any, Dict, List

import numpy as np

from generate import Draft, draw_ground, draw_reference
from machines import _number

Yaml = Dict[str, Any]


class _Scene:
    """What is in it so far."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng, self.parts = rng, ['<link name="world"/>\n']
        self.planar = bool(rng.random() < 0.5)
        self.duration = _number(rng.uniform(0.25, 0.6), 3)
        self.law: Dict[str, float] = {}
        if rng.random() < 0.75:
            self.law["friction"] = _number(rng.uniform(0.1, 1.2), 3)
        if rng.random() < 0.3:
            self.law["restitution"] = _number(rng.uniform(0.1, 0.8), 3)
        self.ground = draw_ground(rng, self.planar, self.duration) if rng.random() < 0.3 else {"kind": "plane"}
        self.level = self.ground["kind"] == "plane" and "normal" not in self.ground
        self.height = 0.0 if self.level else 0.15  # [m], above which nothing touches the ground
        self.yaml: Yaml = {"base": "fixed", "constraints": {}, "efforts": {},
                           "nominal": {"positions": {}, "velocities": {}, "inputs": {}}}

    def touch(self, name: str, **constraint: Any) -> None:
        """One more constraint."""
        self.yaml["constraints"][name] = {**constraint, **self.law}

    def free(self, name: str, mass: float, half: np.ndarray, place: List[float]) -> None:
        """A body that moves as it likes: in the plane of x and z, or in space."""
        square = half ** 2
        inertia = mass / 3 * (square.sum() - square)
        self.parts.append(f'<link name="{name}"><inertial><mass value="{mass:.6g}"/><inertia ixx="{inertia[0]:.6g}" '
                          f'iyy="{inertia[1]:.6g}" izz="{inertia[2]:.6g}" ixy="0" ixz="0" iyz="0"/></inertial></link>\n')
        kind, axis = ("planar", '<axis xyz="0 1 0"/>') if self.planar else ("floating", "")
        self.parts.append(f'<joint name="{name}" type="{kind}"><parent link="world"/><child link="{name}"/>'
                          f'<origin xyz="{place[0]:.6g} {place[1]:.6g} {place[2]:.6g}"/>{axis}</joint>\n')

    def slide(self, name: str, parent: str, origin: List[float], axis: str, mass: float) -> None:
        """A carriage on rails."""
        self.parts.append(f'<link name="{name}"><inertial><mass value="{mass:.6g}"/><inertia ixx="0.001" iyy="0.001" '
                          'izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>\n')
        self.parts.append(f'<joint name="{name}" type="prismatic"><parent link="{parent}"/><child link="{name}"/>'
                          f'<origin xyz="{origin[0]:.6g} {origin[1]:.6g} {origin[2]:.6g}"/><axis xyz="{axis}"/>'
                          '<limit lower="-9" upper="9" effort="99" velocity="9"/></joint>\n')

    def corners(self, half: np.ndarray, z: float) -> List[List[float]]:
        """Two corners of a box in the plane, three or four points in space, at a height of its own frame."""
        x, y = _number(half[0]), _number(half[1])
        if self.planar:
            return [[-x, 0, z], [x, 0, z]]
        if self.rng.random() < 0.5:
            return [[x, 0, z], [-x, y, z], [-x, -y, z]]
        return [[x, y, z], [x, -y, z], [-x, y, z], [-x, -y, z]]


def _box(scene: _Scene, name: str, x: float, half: np.ndarray) -> None:
    """A box whose lower corners are above the ground by a little."""
    gap = _number(scene.rng.uniform(0.002, 0.06))
    scene.free(name, math.exp(scene.rng.uniform(-1.5, 1)), half, [x, 0, scene.height + gap + half[2]])
    for k, corner in enumerate(scene.corners(half, _number(-half[2]))):
        scene.touch(f"{name}_{k}", link=name, point=corner, **scene.ground)


def _top(scene: _Scene, name: str, box: str, x: float, z: float) -> None:
    """One more box, above the upper face of a box, at `z` of that box."""
    half = scene.rng.uniform(0.03, 0.08, 3).round(4)
    scene.free(name, math.exp(scene.rng.uniform(-1.5, 0.5)), half,
               [x, 0, scene.height + 2 * z + 0.07 + half[2] + _number(scene.rng.uniform(0, 0.03))])
    for k, corner in enumerate(scene.corners(half, -_number(half[2]))):
        scene.touch(f"{name}_{k}", kind="link_plane", link=name, point=corner, other_link=box,
                    other_point=[0, 0, _number(z)], normal=[0, 0, 1])


def _beside(scene: _Scene, left: str, right: str, reach: float, other: float) -> None:
    """One or two knobs on the right face of a body before the left face of the next."""
    for k in range(int(scene.rng.integers(1, 3))):
        z = _number(scene.rng.uniform(-0.03, 0.03)) if k == 0 else 0.04
        y = 0 if scene.planar else _number(scene.rng.uniform(-0.03, 0.03))
        scene.touch(f"{left}_{right}_{k}", kind="link_plane", link=left, point=[_number(reach), y, z], other_link=right,
                    other_point=[-_number(other), 0, 0], normal=[-1, 0, 0])


def _ball(scene: _Scene, name: str, x: float, radius: float) -> None:
    """A ball above the level ground."""
    gap = _number(scene.rng.uniform(0.002, 0.1))
    scene.free(name, math.exp(scene.rng.uniform(-2, 0.5)), np.full(3, radius * 0.77), [x, 0, radius + gap])
    scene.touch(f"{name}_ground", kind="plane", link=name, point=[0, 0, 0], radius=radius)


def _fingers(scene: _Scene, box: str, x: float, half: np.ndarray) -> None:
    """One or two fingers that press the box from the sides; they may hang on a lift."""
    rng, carrier = scene.rng, "world"
    if rng.random() < 0.5:
        scene.slide("lift", "world", [x, 0, 0], "0 0 1", math.exp(rng.uniform(-1, 1)))
        carrier = "lift"
        scene.yaml["efforts"]["lift"] = {"kind": "track", "joint": "lift", "feed_forward": "lift_e", "stiffness": 2000,
                                         "damping": 60, "reference": draw_reference(rng, scene.duration, 0.1)}
        scene.yaml["gravity_compensation"] = {"joints": ["lift"], "share": 1}
    at = 0.0 if carrier == "lift" else x
    for side, name in ((-1, "left"), (1, "right"))[:int(rng.integers(1, 3))]:
        gap, radius = _number(rng.uniform(0.002, 0.04)), 0.01
        face = _number(half[0])
        scene.slide(name, carrier, [at + side * (face + radius + gap), 0, half[2] + _number(rng.uniform(-0.02, 0.02))],
                    f"{-side} 0 0", math.exp(rng.uniform(-2, 0)))
        scene.touch(name, kind="link_plane", link=name, point=[0, 0, 0], radius=radius, other_link=box,
                    other_point=[side * face, 0, 0], normal=[side, 0, 0])
        damping = _number(rng.uniform(0, 8), 2)
        scene.yaml["efforts"][f"press_{name}"] = {"kind": "actuator", "joint": name, "input": f"{name}_force"}
        scene.yaml["efforts"][f"damper_{name}"] = {"kind": "joint_spring", "joint": name, "damping": damping}
        scene.yaml["nominal"]["inputs"][f"{name}_force"] = _number(rng.uniform(1, 30), 2)


def draw(seed: int) -> Draft:
    """The scene of this seed."""
    rng = np.random.default_rng([seed, 4])
    scene = _Scene(rng)
    x, last, reach = 0.0, "", 0.0
    for k in range(int(rng.integers(1, 4))):
        if scene.level and rng.random() < 0.3:
            radius, name = _number(rng.uniform(0.03, 0.08)), f"ball{k}"
            x += reach + radius + _number(rng.uniform(0.003, 0.05)) if last else 0
            _ball(scene, name, x, radius)
            if last.startswith("ball"):
                scene.touch(f"{last}_{name}", kind="spheres", link=last, point=[0, 0, 0], radius=reach, other_link=name,
                            other_point=[0, 0, 0], other_radius=radius)
            elif last:
                scene.touch(f"{last}_{name}", kind="link_plane", link=name, point=[0, 0, 0], radius=radius,
                            other_link=last, other_point=[_number(reach), 0, 0], normal=[1, 0, 0])
            last, reach = name, radius
            continue
        half, name = rng.uniform(0.03, 0.1, 3).round(4), f"box{k}"
        x += reach + float(half[0]) + _number(rng.uniform(0.003, 0.05)) if last else 0
        _box(scene, name, x, half)
        if last.startswith("box"):
            _beside(scene, last, name, reach, half[0])
        elif last:
            scene.touch(f"{last}_{name}", kind="link_plane", link=last, point=[0, 0, 0], radius=reach, other_link=name,
                        other_point=[-_number(half[0]), 0, 0], normal=[-1, 0, 0])
        if rng.random() < 0.25:
            _top(scene, f"top{k}", name, x, half[2])
        if k == 0 and rng.random() < 0.5:
            _fingers(scene, name, x, half)
        last, reach = name, float(half[0])
    urdf, level = f'<robot name="o">\n{"".join(scene.parts)}</robot>', bool(rng.random() < 0.6)
    return Draft(urdf, scene.yaml, scene.duration, level, placed=True)
