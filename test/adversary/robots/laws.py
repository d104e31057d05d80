# SPDX-License-Identifier: BSD-3-Clause
"""What mechanics asks of a run, looked at everywhere along it and at each event, by numbers that no event decided: gaps do not
close below zero, forces push, friction is in its cone and against the slip, M dv/dt is what acts, jumps of M v are impulses,
an impact gives no energy and keeps no approach."""
import re
from typing import Any, Dict, Iterator, List, Tuple

import numpy as np

import contact_flow as cf
from trial import Trial

SAMPLES = 40  # of each arc, at irregular places, thick at its ends
GAP, RATE = 1e-8, 1e-6  # [m], [m/s], beside the size of state and speed
REST = 2e-8  # [m/s] what an event may make rest
KINETIC = 1e-15  # rounding of a kinetic energy
FORCE = 1e-6  # beside the largest one
SHORT = 1e-6  # [s] beside Painlevé's obstacles, and as a slip in space turns before it ends, forces leave their bounds
MOTION = 1e-4  # of M dv/dt, a difference quotient, beside the largest term


class Contacts:
    """The rows of a robot: normal ones, those of closures, and of friction for the contacts that have it."""

    def __init__(self, robot: cf.Robot, coefficients: Dict[str, float]) -> None:
        self.robot, self.names = robot, list(robot.constraints)
        self.friction: List[float] = [coefficients.get(name, 0.0) for name in self.names]
        planar = "base_z" in robot.velocities and "base_y" not in robot.velocities
        self.rows: List[List[int]] = []
        row = len(self.names) + len(robot.bilateral)
        for mu in self.friction:
            count = 0 if mu == 0 else 1 if planar else 2
            self.rows.append(list(range(row, row + count)))
            row += count
        self.size = row

    def at(self, x: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gaps, rows, and their rates at a state."""
        q, v = x[:self.robot.num_positions], x[self.robot.num_positions:]
        gap, jacobian, _ = self.robot.constraint_terms(q, v)
        return gap, jacobian, jacobian @ v


def instants(trial: Trial, arc: Any) -> Iterator[float]:
    """Places of an arc, thick at its ends."""
    length = arc.t_end - arc.t_begin
    for s in np.sort(trial.random(70).uniform(0, 1, SAMPLES)):
        yield arc.t_begin + length * float(0.5 - 0.5 * np.cos(np.pi * s))


def weigh_letters(trial: Trial, contacts: Contacts, x: np.ndarray, force: np.ndarray, word: str, t: float) -> None:
    """One state of an arc beside its word."""
    gap, _, rate = contacts.at(x)
    verdict, size, speed = trial.verdict, 1 + float(np.abs(x[:trial.robot.num_positions]).max()), 1 + float(np.abs(rate).max())
    least = FORCE * (1 + float(np.abs(force).max()))
    for i, letter in enumerate(word):
        name = f"'{contacts.names[i]}' ({letter}) at {t:.6f}"
        if letter == "o":
            verdict.weigh("open gap", gap[i] >= -GAP * size, f"{name} is {gap[i]:.2e}")
            verdict.weigh("force of an open contact", force[i] == 0, f"{name} is {force[i]:.2e}")
            continue
        verdict.weigh("closed gap", abs(gap[i]) <= GAP * size, f"{name} is {gap[i]:.2e}")
        verdict.weigh("rate of a closed gap", abs(rate[i]) <= RATE * speed, f"{name} is {rate[i]:.2e}")
        verdict.weigh("force of a closed contact", force[i] >= -least, f"{name} is {force[i]:.2e}")
        rows, mu = contacts.rows[i], contacts.friction[i]
        if not rows:
            continue
        slip, drag = rate[rows], force[rows]
        if letter == "s":
            verdict.weigh("slip of a contact that sticks", float(np.linalg.norm(slip)) <= RATE * speed, f"{name} is {slip}")
            verdict.weigh("cone", float(np.linalg.norm(drag)) <= mu * force[i] + least, f"{name} {drag} of {force[i]:.3e}")
        else:
            fast = float(np.linalg.norm(slip))
            verdict.weigh("drag", float(np.linalg.norm(drag * fast + mu * force[i] * slip)) <= (least + MOTION * force[i]) * fast
                          + RATE * force[i], f"{name} {drag} beside slip {slip} and {force[i]:.3e}")


def weigh_motion(trial: Trial, contacts: Contacts, arc: Any, t: float) -> None:
    """M dv/dt beside what acts, where the arc has room for a quotient."""
    robot, run = trial.robot, trial.run
    step = 1e-5 * min(1.0, arc.t_end - arc.t_begin)
    if step < 1e-8 or t - 2 * step < arc.t_begin or t + 2 * step > arc.t_end:
        return
    n, x = robot.num_positions, run.x(t)
    ahead, behind = run.x(t + step)[n:], run.x(t - step)[n:]
    mass = robot.mass_matrix(x[:n])
    heavy = np.diag(mass) > 1e30  # a clock
    _, jacobian, _ = contacts.at(x)
    acceleration = (ahead - behind) / (2 * step)
    acceleration[heavy] = 0
    applied, pushed = robot.force(x[:n], x[n:], run.u(t), arc.mode), jacobian.T @ run.force(t)
    left = np.delete(mass @ acceleration - applied - pushed, np.flatnonzero(heavy))
    size = 1 + max(float(np.abs(part).max()) for part in (applied, pushed))
    trial.verdict.weigh("motion", float(np.abs(left).max()) <= MOTION * size, f"at {t:.6f} {np.abs(left).max():.2e} of {size:.2e}")


def weigh_jump(trial: Trial, contacts: Contacts, event: Any, last: bool) -> None:
    """M (v⁺ − v⁻) beside impulses, which push, in their cones, and leave no approach; energy where nothing is driven."""
    robot, verdict, n = trial.robot, trial.verdict, trial.robot.num_positions
    minus, plus = np.array(event.x_minus), np.array(event.x_plus)
    gap, jacobian, before = contacts.at(minus)
    after, impulse, jump = jacobian @ plus[n:], np.array(event.impulse), plus[n:] - minus[n:]
    mass = robot.mass_matrix(minus[:n])
    heavy = np.flatnonzero(np.diag(mass) > 1e30)
    mass[heavy, heavy] = 0
    pushed = jacobian.T @ impulse
    pushed[heavy] = 0
    size, speed = 1 + float(np.abs(pushed).max()), 1 + float(np.abs(before).max())
    name = f"event at {event.t:.6f}"
    heaviest = float(np.diag(mass).max())
    lost = abs(event.energy_lost) + KINETIC * float(minus[n:] @ mass @ minus[n:])  # a difference of kinetic energies
    rest = float(np.sqrt(2 * lost * heaviest)) + REST * heaviest  # of what was made rest, by no impulse
    left = float(np.abs(mass @ jump - pushed).max())
    verdict.weigh("jump", left <= 1e-7 * size + rest, f"{name} {left:.2e} of {size:.2e}, rest {rest:.2e}")
    for i, letter in enumerate(event.word_after):
        if event.word_before[i] == letter == "o" and contacts.names[i] not in event.activated:
            continue
        what = f"{name}, '{contacts.names[i]}' {event.word_before[i]}{letter}"
        if last:  # of this instant
            verdict.weigh("approach after", after[i] >= -RATE * speed, f"{what} {after[i]:.2e}")
        if not event.obstacle.ok:  # shares of impulses that are not unique
            continue
        verdict.weigh("impulse", impulse[i] >= -1e-9 * size, f"{what} {impulse[i]:.2e}")
        drag = float(np.linalg.norm(impulse[contacts.rows[i]])) if contacts.rows[i] else 0.0
        verdict.weigh("cone of impulses", drag <= contacts.friction[i] * impulse[i] + 1e-9 * size, f"{what} {drag:.3e}")
    if not len(heavy):
        energies = [0.5 * float(v @ mass @ v) for v in (minus[n:], plus[n:])]
        verdict.weigh("energy", energies[1] <= energies[0] + 1e-9 * (1 + energies[0]) + 2 * abs(event.energy_lost), f"{name} {energies}")


def judge(trial: Trial) -> None:
    """Every arc and every event of the run; brakes are contacts whose drag is the joint's."""
    yaml = trial.draft.yaml
    made = float(yaml.get("contacts", {}).get("friction", 0))  # of contacts made from geometry
    coefficients = {name: 0.0 if name.endswith(("_lower", "_upper")) else made for name in trial.robot.constraints}
    coefficients.update({name: float(constraint.get("friction", 0)) for name, constraint in yaml["constraints"].items()})
    contacts = Contacts(trial.robot, coefficients)
    shared = [warning.t for warning in trial.run.warnings
              if warning.code == "indeterminate forces" and re.search(r"decides? the motion", warning.message)]
    unique = min(shared, default=float("inf"))  # until then: shares that decide may leave their cones, which is told
    if len(trial.robot.constraint_terms(trial.run.x0[:trial.robot.num_positions], np.zeros(trial.robot.dof))[0]) != contacts.size:
        trial.verdict.counts["laws: other rows"] += 1  # brakes
        return
    for arc in trial.run.arcs:
        if arc.t_end - arc.t_begin < SHORT:
            trial.verdict.counts["laws: short arcs"] += 1
            continue
        if arc.t_begin >= unique:
            trial.verdict.counts["laws: arcs of forces that are not unique"] += 1
            continue
        for t in instants(trial, arc):
            if arc.t_end - t < SHORT:
                continue
            weigh_letters(trial, contacts, np.array(trial.run.x(t)), np.array(trial.run.force(t)), arc.word, t)
        weigh_motion(trial, contacts, arc, 0.5 * (arc.t_begin + arc.t_end))
    events = list(trial.run.events)
    for k, event in enumerate(events):
        weigh_jump(trial, contacts, event, k + 1 == len(events) or events[k + 1].t > event.t)
