# SPDX-License-Identifier: BSD-3-Clause
"""Random robots of what the others lack, from a seed: loops closed by points, feet that are boxes, whose contacts are made
from their geometry, links that float or slide in a plane on bushings, and corners of the world below a face of the body."""
import math
from typing import Any, Dict, List

import numpy as np

from generate import Draft, draw_ground
from machines import _drive, _joint, _link, _number

Yaml = Dict[str, Any]
LENGTH = 0.4  # of a leg [m]


def _box_leg(rng: np.random.Generator, yaml: Yaml, k: int, place: List[float], duration: float) -> List[str]:
    """A leg with a foot that is a box, or half of one, on an ankle."""
    size = [_number(s) for s in rng.uniform([0.08, 0.05, 0.02], [0.25, 0.15, 0.06])]
    box = (f'<collision><origin xyz="{_number(rng.uniform(-0.02, 0.05))} 0 {-size[2] / 2!r}"/>'
           f'<geometry><box size="{size[0]} {size[1]} {size[2]}"/></geometry></collision></link>')
    foot = _link(f"foot{k}", math.exp(rng.uniform(-2, 0)), 0.1, -0.02).replace("</link>", box)
    slides = rng.random() < 0.3
    for joint in (f"hip{k}", f"ankle{k}"):
        yaml["efforts"][f"drive_{joint}"] = _drive(rng, duration)(joint)
        yaml["nominal"]["positions"][joint] = 0.0
    yaml["contacts"]["ground"].append(f"foot{k}")
    return [_link(f"leg{k}", math.exp(rng.uniform(-2, 0)), 0.3, -LENGTH / 2), foot,
            _joint(f"hip{k}", "prismatic" if slides else "revolute", "body", f"leg{k}", place,
                   "0 0 1" if slides else "0 1 0"),
            _joint(f"ankle{k}", "revolute", f"leg{k}", f"foot{k}", [0, 0, -LENGTH], "0 1 0")]


def _parallel_leg(rng: np.random.Generator, yaml: Yaml, k: int, place: List[float], duration: float) -> List[str]:
    """Two parallel bars and what they carry, which does not turn; its foot is a point."""
    apart, bend = _number(rng.uniform(0.06, 0.2)), _number(rng.uniform(-0.4, 0.4))
    mass = math.exp(rng.uniform(-2, 0))
    parts = [_link(f"{name}{k}", mass, 0.2, -LENGTH / 2) for name in ("bar", "rod")] + [_link(f"shoe{k}", mass, 0.1, -0.05)]
    parts += [_joint(f"bar{k}", "revolute", "body", f"bar{k}", place, "0 1 0"),
              _joint(f"rod{k}", "revolute", "body", f"rod{k}", [place[0] + apart, *place[1:]], "0 1 0"),
              _joint(f"shoe{k}", "revolute", f"bar{k}", f"shoe{k}", [0, 0, -LENGTH], "0 1 0")]
    yaml["nominal"]["positions"].update({f"bar{k}": bend, f"rod{k}": bend, f"shoe{k}": -bend})
    yaml["closures"][f"loop{k}"] = {"link": f"shoe{k}", "point": [apart, 0, 0], "other_link": f"rod{k}",
                                    "other_point": [0, 0, -LENGTH], "axes": "xz", "frame": f"{rng.choice(['rod', 'shoe'])}{k}"}
    yaml["efforts"][f"drive_bar{k}"] = _drive(rng, duration)(f"bar{k}")
    yaml["constraints"][f"c{k}"] = {"link": f"shoe{k}", "point": [_number(apart / 2), 0, -0.1], "kind": "plane"}
    return parts


def _hung(rng: np.random.Generator, yaml: Yaml, kind: str) -> List[str]:
    """A link that floats, or slides in a plane, on a bushing."""
    at = [_number(rng.uniform(-0.2, 0.2)), _number(rng.uniform(-0.2, 0.2)), 0.2]
    yaml["efforts"][f"bushing_{kind}"] = {
        "kind": "frame_spring", "link": f"{kind}_load", "point": [0, 0, 0], "other_link": "body", "other_point": at,
        "stiffness": _number(math.exp(rng.uniform(4, 7)), 2), "damping": _number(rng.uniform(0, 5), 3),
        "turn_stiffness": _number(rng.uniform(1, 30), 2), "turn_damping": _number(rng.uniform(0, 0.5), 3)}
    return [_link(f"{kind}_load", math.exp(rng.uniform(-1.5, 0.5)), 0.2, _number(rng.uniform(-0.05, 0.05))),
            _joint(f"{kind}_load", kind, "body", f"{kind}_load", at, "0 0.6 0.8")]


def draw(seed: int) -> Draft:
    """The robot of this seed, above its ground by an unknown height."""
    rng = np.random.default_rng([seed, 3])
    base, duration = str(rng.choice(["floating", "planar"])), _number(rng.uniform(0.25, 0.6), 3)
    law: Dict[str, float] = {}
    if rng.random() < 0.6:
        law["friction"] = _number(rng.uniform(0.2, 1.2), 3)
    if rng.random() < 0.25:
        law["restitution"] = _number(rng.uniform(0.1, 0.7), 3)
    yaml: Yaml = {"base": base, "constraints": {}, "efforts": {}, "closures": {}, "contacts": {"ground": [], **law},
                  "nominal": {"positions": {}, "velocities": {}}}
    parts = [_link("body", math.exp(rng.uniform(0, 2)), rng.uniform(0.2, 0.5), 0)]
    for k in range(int(rng.integers(1, 3 if base == "planar" else 4))):
        place = [_number(rng.uniform(-0.4, 0.4)), 0 if base == "planar" else _number(rng.uniform(-0.4, 0.4)), 0]
        leg = _box_leg if base == "floating" and rng.random() < 0.5 else _parallel_leg
        parts += leg(rng, yaml, k, place, duration)
    for kind in ("floating", "planar"):
        if base == "floating" and rng.random() < 0.3:
            parts += _hung(rng, yaml, kind)
    surface = draw_ground(rng, base == "planar", duration) if rng.random() < 0.3 else {"kind": "plane"}
    for constraint in yaml["constraints"].values():
        constraint.update(surface, **law)
    if rng.random() < 0.3:
        yaml["constraints"]["corner"] = {
            "kind": "link_plane", "link": "world", "point": [_number(rng.uniform(-0.2, 0.2)), 0, 0.3],
            "other_link": "body", "other_point": [0, 0, -0.05], "normal": [_number(rng.normal(0, 0.2)), 0, -1], **law}
    if not yaml["contacts"]["ground"]:
        del yaml["contacts"]
    return Draft(f'<robot name="k">\n{"".join(parts)}</robot>', yaml, duration, level=True)
