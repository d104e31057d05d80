# SPDX-License-Identifier: BSD-3-Clause
"""The same robot with a stranger beside it, which it never touches: heavy, light, fast, far, stiff, pressed, sliding,
spinning, bouncing. It moves as it does alone, and neither follows the other to first order."""
import re
from typing import Any, Callable, Dict, List

import numpy as np

import contact_flow as cf
from generate import Draft
from trial import DERIVATIVE, OPTIONS, Trial

APART = 1e-7  # of states and derivatives, times their size
GROUND = "beside_ground"


def _joint(name: str, kind: str, parent: str, child: str, axis: str) -> str:
    return (f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
            '<limit lower="-1e9" upper="1e9" effort="9" velocity="9"/></joint>\n')


def _body(name: str, mass: float, kind: str, axis: str, parent: str = GROUND) -> str:
    """A link on a joint of the stranger."""
    return (f'<link name="{name}_body"><inertial><mass value="{mass!r}"/><inertia ixx="{mass!r}" iyy="{mass!r}" '
            f'izz="{mass!r}" ixy="0" ixz="0" iyz="0"/></inertial></link>\n' +
            _joint(name, kind, parent, f"{name}_body", axis))


def _falling(mass: float) -> Callable[..., str]:
    return lambda *_: _body("sz", mass, "prismatic", "0 0 1")


def _fast(yaml: Dict[str, Any], big: float, _: np.random.Generator) -> str:
    yaml["nominal"]["velocities"]["sx"] = big
    return _body("sx", 1.0, "prismatic", "1 0 0")


def _far(yaml: Dict[str, Any], big: float, _: np.random.Generator) -> str:
    yaml["nominal"]["positions"]["sx"] = big
    return _body("sx", 1.0, "prismatic", "1 0 0")


def _spinning(yaml: Dict[str, Any], big: float, _: np.random.Generator) -> str:
    yaml["nominal"]["velocities"]["sw"] = big ** 0.5
    return _body("sw", 1.0, "continuous", "0 0.6 0.8")


def _stiff(yaml: Dict[str, Any], big: float, _: np.random.Generator) -> str:
    """Swings to its rest while the robot moves."""
    yaml["nominal"]["positions"]["sx"] = 0.1
    yaml["efforts"]["stranger"] = {"kind": "joint_spring", "joint": "sx", "stiffness": big, "damping": 2 * big ** 0.5}
    return _body("sx", 1.0, "prismatic", "1 0 0")


def _pressed(yaml: Dict[str, Any], big: float, _: np.random.Generator) -> str:
    yaml["constraints"]["stranger"] = {"kind": "lower_limit", "joint": "sz", "lower": 0}
    return _body("sz", big, "prismatic", "0 0 1")


def _bouncing(yaml: Dict[str, Any], big: float, rng: np.random.Generator) -> str:
    yaml["constraints"]["stranger"] = {"kind": "lower_limit", "joint": "sz", "lower": 0, "restitution": 0.8}
    yaml["nominal"]["positions"]["sz"] = float(rng.uniform(0.1, 0.3))
    return _body("sz", float(rng.choice([big, 1 / big])), "prismatic", "0 0 1")


def _sliding(yaml: Dict[str, Any], big: float, rng: np.random.Generator) -> str:
    """A box that slides on the ground, in the plane or in space, to its rest, or lies there."""
    mass, speed = float(rng.choice([big, 1 / big, 1])), float(rng.choice([0, 1e-3, 1, 10]))
    yaml["constraints"]["stranger"] = {"kind": "plane", "link": "sz_body", "point": [0, 0, 0], "friction": 0.5}
    yaml["nominal"]["velocities"]["sx"] = speed
    links = _body("sx", mass, "prismatic", "1 0 0")
    parent = "sx_body"
    if rng.random() < 0.5:
        yaml["nominal"]["velocities"]["sy"] = -0.3 * speed
        links += _body("sy", mass, "prismatic", "0 1 0", parent)
        parent = "sy_body"
    return links + _body("sz", mass, "prismatic", "0 0 1", parent)


STRANGERS: Dict[str, Callable[[Dict[str, Any], float, np.random.Generator], str]] = {
    "fast": _fast, "far": _far, "spinning": _spinning, "stiff": _stiff, "pressed": _pressed, "bouncing": _bouncing,
    "sliding": _sliding}


def rooted(draft: Draft) -> Draft:
    """The robot whose base hangs on a fixed one by a joint of the same coordinates."""
    other = draft.copy()
    base, yaml = draft.yaml["base"], other.yaml
    first = re.findall(r'<link name="([^"]*)"', draft.urdf)[0]
    links = f'<link name="{GROUND}"/>\n'
    if base == "planar":
        links += '<link name="beside_x"/>\n<link name="beside_z"/>\n'
        links += _joint("base_x", "prismatic", GROUND, "beside_x", "1 0 0")
        links += _joint("base_z", "prismatic", "beside_x", "beside_z", "0 0 1")
        links += _joint("base_pitch", "revolute", "beside_z", first, "0 1 0")
    else:
        links += _joint("base", base, GROUND, first, "1 0 0")
    at = other.urdf.index(">") + 1
    other.urdf = other.urdf[:at] + links + other.urdf[at:]
    yaml["base"] = "fixed"
    if yaml.get("gravity_compensation", {}).get("joints") == "all":
        moving = re.findall(r'<joint name="([^"]*)" type="(?:revolute|prismatic)"', draft.urdf)
        yaml["gravity_compensation"]["joints"] = moving
    return other


def places(names: List[str], others: List[str]) -> List[int]:
    """Where these names are among others."""
    return [others.index(name) for name in names]


def hold(trial: Trial, kind: str, big: float, rng: np.random.Generator) -> None:
    """The robot beside a stranger of this kind and size, in front of the robot's contacts or behind them."""
    verdict, alone, what, draft = trial.verdict, trial.robot, f"beside {kind}", rooted(trial.draft)
    make = STRANGERS.get(kind) or _falling(big if kind == "heavy" else 1 / big)
    links = make(draft.yaml, big, rng)
    if rng.random() < 0.5:
        draft.yaml["constraints"] = dict(reversed(list(draft.yaml["constraints"].items())))
    draft.urdf = draft.urdf.replace("</robot>", links + "</robot>")
    robot = cf.Robot.from_strings(draft.urdf, draft.text())
    here, moves = places(alone.state_names, robot.state_names), places(alone.velocities, robot.velocities)
    x = robot.nominal.x.copy()
    x[here] = alone.nominal.x
    run = robot.simulate(x, draft.duration, **OPTIONS)
    if run.status.outcome == "budget exceeded":
        verdict.counts[f"{what} ran out of budget"] += 1
        return
    if not run.status.ok:
        verdict.weigh(what, False, run.status.message)
        return
    end = trial.run.final_state
    apart, size = float(np.linalg.norm(run.final_state[here] - end)), 1 + float(np.linalg.norm(end))
    verdict.weigh(what, apart <= APART * size, f"states {apart:.2e} apart")
    B = run.derivative(**DERIVATIVE)
    if B.status.ok != (trial.derivative is not None):
        verdict.counts[f"{what}: one of two has a derivative, {B.status.outcome}"] += 1
    if not B.status.ok or trial.derivative is None:
        return
    w, wide = trial.direction(rng), np.zeros(2 * robot.dof)
    mine = moves + [robot.dof + k for k in moves]
    wide[mine] = w
    try:
        b, other = trial.derivative(w), B(wide)
        stated = float(np.linalg.norm(trial.derivative.error(w)) + np.linalg.norm(B.error(wide)[mine]))
    except (ValueError, RuntimeError):
        return
    stated += trial.derivative.trust.derivative_error  # rounding is another one; the stranger's is not the robot's
    error, size = float(np.linalg.norm(other[mine] - b)), 1 + float(np.linalg.norm(b))
    verdict.weigh(f"derivative, {what}", error <= 3 * stated + APART * size,
                  f"{error:.2e} of {size - 1:.2e} apart, stated {stated:.1e}")
    follows = float(np.linalg.norm(np.delete(other, mine)))
    verdict.weigh(f"derivative of the stranger, {what}", follows <= APART * size, f"{follows:.2e}")


def judge(trial: Trial) -> None:
    """One stranger, drawn from the seed."""
    rng = trial.random(71)
    kind = str(rng.choice(["heavy", "light", *STRANGERS]))
    hold(trial, kind, 10 ** float(rng.uniform(2, 7)), rng)
