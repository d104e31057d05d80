# SPDX-License-Identifier: BSD-3-Clause
"""Random robots as people build them, from a seed: tables whose equal legs land together or nearly so, soft feet, gears
and mimic joints, stops, motors that tire, bushings, tendons, wheels, balls between links, state feedback."""
import math
from typing import Any, Callable, Dict, List, Tuple

import numpy as np

from generate import Draft, draw_ground, draw_reference

Tree = Tuple[List[str], Dict[str, float]]  # parts of the URDF, positions of its joints


def _number(value: float, digits: int = 4) -> float:
    return round(float(value), digits)


def _link(name: str, mass: float, size: float, center: float) -> str:
    inertia = mass * size ** 2 / 6
    return (f'<link name="{name}"><inertial><origin xyz="0 0 {center:.6g}"/><mass value="{mass:.6g}"/>'
            f'<inertia ixx="{inertia:.6g}" iyy="{1.2 * inertia:.6g}" izz="{0.9 * inertia:.6g}" ixy="0" ixz="0" iyz="0"/>'
            '</inertial></link>\n')


def _joint(name: str, kind: str, parent: str, child: str, origin: List[float], axis: str, more: str = "") -> str:
    return (f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{origin[0]:.6g} {origin[1]:.6g} {origin[2]:.6g}"/><axis xyz="{axis}"/>'
            f'<limit lower="-1.5" upper="1.5" effort="40" velocity="12"/>{more}</joint>\n')


def _drive(rng: np.random.Generator, duration: float) -> Callable[[str], Dict[str, Any]]:
    """An effort of one kind and size for every joint that asks."""
    stiffness, damping = _number(math.exp(rng.uniform(2, 7)), 2), _number(math.exp(rng.uniform(-1, 2)), 3)
    kind = str(rng.choice(["joint_spring", "servo", "pd", "track"]))
    drive: Dict[str, Any] = {"kind": kind, "stiffness": stiffness, "damping": damping}
    if kind == "track":
        drive["reference"] = draw_reference(rng, duration, 0.2)
    if kind != "joint_spring" and rng.random() < 0.4:
        drive["limit"] = _number(math.exp(rng.uniform(1, 4)), 2)
        if rng.random() < 0.5:
            drive.update(speed=_number(rng.uniform(1, 12), 2), stall=_number(drive["limit"] * rng.uniform(0.8, 2), 2))

    def of(joint: str) -> Dict[str, Any]:
        names = {"servo": {"input": f"{joint}_q"}, "track": {"feed_forward": f"{joint}_e"},
                 "pd": {"position": f"{joint}_q", "velocity": f"{joint}_v", "feed_forward": f"{joint}_e"}}
        return {**drive, "joint": joint, **names.get(kind, {})}

    return of


def _table(rng: np.random.Generator, yaml: Dict[str, Any], duration: float, law: Dict[str, float]) -> Tree:
    """A body on equal legs, here and there one a little shorter. Adds their contacts and drives to the YAML."""
    planar = yaml["base"] == "planar"
    parts, positions = [_link("body", math.exp(rng.uniform(0, 2)), rng.uniform(0.2, 0.6), 0)], {}
    slides, knees = rng.random() < 0.5, rng.random() < 0.4
    bend, mass = _number(rng.uniform(-0.5, 0.5)), math.exp(rng.uniform(-3, 0))
    drive = _drive(rng, duration)
    sole = {"stiffness": _number(math.exp(rng.uniform(6, 9)), 1), "damping": _number(math.exp(rng.uniform(1, 4)), 2),
            "mass": _number(rng.uniform(0.02, 0.2))}
    soft = rng.random() < 0.3
    surface = draw_ground(rng, planar, duration) if rng.random() < 0.2 else {"kind": "plane"}
    for k in range(int(rng.integers(2, 4 if planar else 5))):
        place = [rng.uniform(-0.4, 0.4), 0 if planar else rng.uniform(-0.4, 0.4), 0]
        foot, length = f"leg{k}", 0.4
        parts += [_link(f"leg{k}", mass, 0.3, -0.2), _joint(f"hip{k}", "prismatic" if slides else "revolute", "body", foot,
                                                           place, "0 0 1" if slides else "0 1 0")]
        yaml["efforts"][f"drive_hip{k}"] = drive(f"hip{k}")
        positions[f"hip{k}"] = 0 if slides else bend
        if knees:
            foot = f"shin{k}"
            parts += [_link(foot, 0.6 * mass, 0.2, -0.1), _joint(f"knee{k}", "revolute", f"leg{k}", foot, [0, 0, -0.4],
                                                                 "0 1 0")]
            yaml["efforts"][f"drive_knee{k}"] = drive(f"knee{k}")
            positions[f"knee{k}"] = -2 * bend
        if rng.random() < 0.1:
            length -= 10 ** -rng.uniform(2, 9)
        if soft:
            yaml.setdefault("soles", {})[foot] = sole
        yaml["constraints"][f"c{k}"] = {"link": foot + ("_sole" if soft else ""), "point": [0, 0, -length], **surface, **law}
    return parts, positions


def _arm(rng: np.random.Generator, yaml: Dict[str, Any], duration: float, law: Dict[str, float]) -> Tree:
    """A chain or a bush of links whose tips reach the ground. Adds contacts and drives, too."""
    planar = yaml["base"] == "planar"
    free = yaml["base"] != "fixed"
    parts = [_link("body", 2, 0.4, 0) if free else '<link name="body"/>\n']
    links, positions = int(rng.integers(2, 5)), {}
    surface = draw_ground(rng, planar, duration)
    for k in range(links):
        parent = "body" if k == 0 else f"arm{int(rng.integers(max(0, k - 2), k))}"
        slides = rng.random() < 0.2
        axis = "0 0 1" if slides else ("0 1 0" if planar else str(rng.choice(["0 1 0", "1 0 0", "0.6 0.8 0"])))
        parts += [_link(f"arm{k}", math.exp(rng.uniform(-1, 1)), 0.3, -0.15),
                  _joint(f"j{k}", "prismatic" if slides else "revolute", parent, f"arm{k}",
                         [rng.uniform(-0.2, 0.2), 0, -0.3 if k else 0], axis)]
        positions[f"j{k}"] = _number(rng.uniform(-0.6, 0.6))
        if rng.random() < 0.7:
            yaml["efforts"][f"drive{k}"] = _drive(rng, duration)(f"j{k}")
        if rng.random() < 0.6 or k == links - 1:
            yaml["constraints"][f"c{k}"] = {"link": f"arm{k}", "point": [0.05, 0, -0.3], **surface, **law}
    return parts, positions


def _wheel(rng: np.random.Generator, yaml: Dict[str, Any], _: Dict[str, float], law: Dict[str, float]) -> None:
    """The first foot is a ball, or in space a wheel, on a plane."""
    first = next(iter(yaml["constraints"].values()))
    kept = {key: first[key] for key in ("link", "point", "motion") if key in first}
    first.clear()
    first.update({**kept, **law}, kind="plane", radius=_number(rng.uniform(0.02, 0.1)))
    if yaml["base"] != "planar" and rng.random() < 0.5:
        first.update(kind="rim", axis=[_number(a) for a in (rng.normal(0, 0.2), 1, rng.normal(0, 0.2))])


def _between(rng: np.random.Generator, yaml: Dict[str, Any], *_: Dict[str, float]) -> None:
    """A spring or a bushing from the body to another link."""
    link = str(rng.choice([c["link"] for c in yaml["constraints"].values()]))
    effort = {"link": link, "point": [0, 0, -0.1], "other_link": "body", "other_point": [0.1, 0, 0.2],
              "stiffness": _number(math.exp(rng.uniform(1, 5)), 2), "damping": _number(rng.uniform(0, 2), 3)}
    if rng.random() < 0.5:
        effort.update(kind="point_spring", length=0.3)
    else:
        effort.update(kind="frame_spring", turn_stiffness=_number(rng.uniform(0, 30), 2),
                      turn_damping=_number(rng.uniform(0, 1), 3))
    yaml["efforts"]["between"] = effort


def _bumper(rng: np.random.Generator, yaml: Dict[str, Any], _: Dict[str, float], law: Dict[str, float]) -> None:
    """A ball of one link against a ball, or a face, of the body."""
    link = list(yaml["constraints"].values())[-1]["link"]
    bumper: Dict[str, Any] = {"link": link, "point": [0.02, 0, 0], "radius": 0.03, "other_link": "body",
                              "other_point": [_number(rng.uniform(-0.3, 0.3)), 0, _number(rng.uniform(-0.3, 0.3))]}
    if rng.random() < 0.5:
        bumper.update(kind="spheres", other_radius=_number(rng.uniform(0, 0.1)))
    else:
        bumper.update(kind="link_plane", normal=[_number(rng.normal()), 0, _number(rng.normal())])
    yaml["constraints"]["bumper"] = {**bumper, **law}


def _feedback(rng: np.random.Generator, yaml: Dict[str, Any], positions: Dict[str, float], _: Dict[str, float]) -> None:
    """Setpoints that see other joints."""
    inputs = [e["input"] for e in yaml["efforts"].values() if e["kind"] == "servo"]
    names = list(positions) + ([] if yaml["base"] == "fixed" else ["base_z"])
    if inputs:
        yaml["feedback"] = {"gains": {name: {"velocities": {str(rng.choice(names)): _number(rng.normal(0, 0.05))},
                                             "positions": {str(rng.choice(list(positions))): _number(rng.normal(0, 0.3))}}
                                      for name in inputs}}


def draw(seed: int) -> Draft:
    """The robot of this seed, above its ground by an unknown height."""
    rng = np.random.default_rng([seed, 2])
    base = str(rng.choice(["floating", "planar", "fixed"], p=[0.4, 0.4, 0.2]))
    duration = _number(rng.uniform(0.25, 0.7), 3)
    law: Dict[str, float] = {}
    if rng.random() < 0.6:
        law["friction"] = _number(rng.uniform(0.2, 1.2), 3)
    if rng.random() < 0.25:
        law["restitution"] = _number(rng.uniform(0.1, 0.7), 3)
    level = base != "fixed" and rng.random() < 0.6
    make = _table if level or (base != "fixed" and rng.random() < 0.5) else _arm
    yaml: Dict[str, Any] = {"base": base, "constraints": {}, "efforts": {}}
    parts, positions = make(rng, yaml, duration, law)
    for chance, add in ((0.15, _wheel), (0.3, _between), (0.15, _bumper), (0.4, _feedback)):
        if rng.random() < chance and not (add is _wheel and level):
            add(rng, yaml, positions, law)
    joints, coupled = list(positions), []
    if len(joints) > 1 and not level and rng.random() < 0.3:  # a gear, as a closure or as a mimic joint
        a, b = (str(name) for name in rng.permutation(joints)[:2])
        ratio = _number(rng.choice([-1, 1]) * rng.uniform(0.3, 2), 3)
        offset = _number(positions[a] - ratio * positions[b], 8)
        coupled.append((a, b, ratio))
        if rng.random() < 0.5:
            yaml["closures"] = {"gear": {"joint": a, "other_joint": b, "multiplier": ratio, "offset": offset}}
        else:
            mimic = f'<mimic joint="{b}" multiplier="{ratio}" offset="{offset}"/></joint>'
            parts = [part.replace("</joint>", mimic) if part.startswith(f'<joint name="{a}"') else part for part in parts]
    if rng.random() < 0.3:
        yaml["joints"] = {"limits": [str(rng.choice(joints))], "restitution": _number(rng.choice([0, 0.3]))}
    if rng.random() < 0.3:
        yaml.setdefault("joints", {})["armature"] = {str(rng.choice(joints)): _number(rng.uniform(0.001, 0.1))}
    if rng.random() < 0.2:
        yaml["gravity_compensation"] = {"joints": "all", "share": _number(rng.uniform(0, 1), 3)}
    yaml["nominal"] = {"positions": positions, "velocities": {}}
    return Draft(f'<robot name="m">\n{"".join(parts)}</robot>', yaml, duration, level, coupled)
