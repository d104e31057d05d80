# SPDX-License-Identifier: BSD-3-Clause
"""The same robot with a stranger beside it, which it never touches: heavy, light, fast, far, stiff, pressed, sliding,
spinning, bouncing, or meeting something when the robot does. It moves as it does alone, and neither follows the other to
first order."""
import re
from dataclasses import dataclass
from typing import Any, Callable, Dict, List

import numpy as np

import contact_flow as cf
from generate import Draft
from trial import DERIVATIVE, OPTIONS, Trial, error_of

APART = 1e-7  # of states and derivatives, times their size
GROUND = "beside_ground"
BEHIND, BEFORE = "s", "a"  # names of joints in their order: the robot's first one is called base


def _joint(name: str, kind: str, parent: str, child: str, axis: str) -> str:
    return (f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
            '<limit lower="-1e9" upper="1e9" effort="9" velocity="9"/></joint>\n')


@dataclass
class Stranger:
    """What a stranger is made of; its joints' names place it before the robot or behind it."""
    prefix: str
    yaml: Dict[str, Any]
    big: float
    rng: np.random.Generator
    instants: List[float]  # of the robot's events [s]

    def body(self, name: str, mass: float, kind: str, axis: str, parent: str = GROUND) -> str:
        """A link on a joint of the stranger."""
        name = self.prefix + name
        return (f'<link name="{name}_body"><inertial><mass value="{mass!r}"/><inertia ixx="{mass!r}" iyy="{mass!r}" '
                f'izz="{mass!r}" ixy="0" ixz="0" iyz="0"/></inertial></link>\n' +
                _joint(name, kind, parent, f"{name}_body", axis))

    def start(self, name: str, position: float = 0.0, velocity: float = 0.0) -> None:
        """Where a joint of it is and how fast."""
        self.yaml["nominal"]["positions"][self.prefix + name] = position
        self.yaml["nominal"]["velocities"][self.prefix + name] = velocity

    def constrain(self, **constraint: Any) -> None:
        """Its only constraint."""
        self.yaml["constraints"]["stranger"] = constraint


def _heavy(s: Stranger) -> str:
    return s.body("z", s.big, "prismatic", "0 0 1")


def _light(s: Stranger) -> str:
    return s.body("z", 1 / s.big, "prismatic", "0 0 1")


def _fast(s: Stranger) -> str:
    s.start("x", velocity=s.big)
    return s.body("x", 1.0, "prismatic", "1 0 0")


def _far(s: Stranger) -> str:
    s.start("x", position=s.big)
    return s.body("x", 1.0, "prismatic", "1 0 0")


def _spinning(s: Stranger) -> str:
    s.start("w", velocity=s.big ** 0.5)
    return s.body("w", 1.0, "continuous", "0 0.6 0.8")


def _stiff(s: Stranger) -> str:
    """Swings to its rest while the robot moves."""
    s.start("x", position=0.1)
    s.yaml["efforts"]["stranger"] = {"kind": "joint_spring", "joint": f"{s.prefix}x", "stiffness": s.big,
                                     "damping": 2 * s.big ** 0.5}
    return s.body("x", 1.0, "prismatic", "1 0 0")


def _pressed(s: Stranger) -> str:
    s.constrain(kind="lower_limit", joint=f"{s.prefix}z", lower=0)
    return s.body("z", s.big, "prismatic", "0 0 1")


def _bouncing(s: Stranger) -> str:
    s.constrain(kind="lower_limit", joint=f"{s.prefix}z", lower=0, restitution=0.8)
    s.start("z", position=float(s.rng.uniform(0.1, 0.3)))
    return s.body("z", float(s.rng.choice([s.big, 1 / s.big])), "prismatic", "0 0 1")


def _sliding(s: Stranger) -> str:
    """A box that slides on the ground, in the plane or in space, to its rest, or lies there."""
    mass, speed = float(s.rng.choice([s.big, 1 / s.big, 1])), float(s.rng.choice([0, 1e-3, 1, 10]))
    s.constrain(kind="plane", link=f"{s.prefix}z_body", point=[0, 0, 0], friction=0.5)
    s.start("x", velocity=speed)
    links = s.body("x", mass, "prismatic", "1 0 0")
    parent = f"{s.prefix}x_body"
    if s.rng.random() < 0.5:
        s.start("y", velocity=-0.3 * speed)
        links += s.body("y", mass, "prismatic", "0 1 0", parent)
        parent = f"{s.prefix}y_body"
    return links + s.body("z", mass, "prismatic", "0 0 1", parent)


def _meeting(s: Stranger) -> str:
    """Hits a wall at the instant of one of the robot's events, or just beside it, and bounces or stays."""
    instant = float(s.rng.choice(s.instants or [0.1])) + float(s.rng.choice([0, 1e-14, 1e-12, -1e-9, 1e-6]))
    speed = float(s.rng.choice([1, s.big, 1 / s.big]))
    s.constrain(kind="lower_limit", joint=f"{s.prefix}x", lower=0, restitution=float(s.rng.choice([0, 0.5])))
    s.start("x", position=speed * instant, velocity=-speed)
    return s.body("x", 1.0, "prismatic", "1 0 0")


STRANGERS: Dict[str, Callable[[Stranger], str]] = {
    "heavy": _heavy, "light": _light, "fast": _fast, "far": _far, "spinning": _spinning, "stiff": _stiff,
    "pressed": _pressed, "bouncing": _bouncing, "sliding": _sliding, "meeting": _meeting}


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


def hold(trial: Trial, kind: str, big: float, rng: np.random.Generator, prefix: str = BEHIND) -> None:
    """The robot beside a stranger of this kind and size, whose contacts come before the robot's or behind them, and
    whose coordinates do, too, by its prefix."""
    verdict, alone, what, draft = trial.verdict, trial.robot, f"beside {kind}", rooted(trial.draft)
    instants = [event.t for event in trial.run.events]
    links = STRANGERS[kind](Stranger(prefix, draft.yaml, big, rng, instants))
    if rng.random() < 0.5:
        draft.yaml["constraints"] = dict(reversed(list(draft.yaml["constraints"].items())))
    draft.urdf = draft.urdf.replace("</robot>", links + "</robot>")
    robot = cf.Robot.from_strings(draft.urdf, draft.text())
    here, moves = places(alone.state_names, robot.state_names), places(alone.velocities, robot.velocities)
    mine = moves + [robot.dof + k for k in moves]
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
    B = run.derivative(**DERIVATIVE)
    told = float(np.linalg.norm(B.trust.state_error[mine])) if B.status.ok else 0.0
    same = apart <= APART * size + 10 * told
    if not same and not B.status.ok and any(warning.code == "zeno" for warning in run.warnings):
        verdict.counts[f"{what}: bounces made rest, of which no error is told"] += 1
    else:
        verdict.weigh(what, same, f"states {apart:.2e} apart, told {told:.1e}")
    if B.status.ok != (trial.derivative is not None):
        verdict.counts[f"{what}: one of two has a derivative, {B.status.outcome}"] += 1
    if not B.status.ok or trial.derivative is None:
        return
    w, wide = trial.direction(rng), np.zeros(2 * robot.dof)
    wide[mine] = w
    try:
        b, other = trial.derivative(w), B(wide)
        stated = float(np.linalg.norm(error_of(trial.derivative, w)) + np.linalg.norm(error_of(B, wide)[mine]))
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
    kind = str(rng.choice(list(STRANGERS)))
    big = 10 ** float(rng.uniform(2, 7))
    hold(trial, kind, big, rng, str(rng.choice([BEHIND, BEFORE])))
