# SPDX-License-Identifier: BSD-3-Clause
"""What moves, for the picture of a report: a robot by its links, a model by the points and bodies that its
coordinates name, what they stand on, contact points with their forces, and ghosts of perturbed outcomes."""
from __future__ import annotations

from typing import Any, Dict, List, Tuple

import numpy as np
from numpy.typing import NDArray

from . import _core
from .report_shapes import shapes

Array = NDArray[np.float64]

FRAMES = 240  #: of the animation
GHOST = 0.1  #: size of the perturbations whose outcomes are shown, in the units of their directions
MAX_GHOSTS = 80  #: directions with ghosts


def numbers(array: Any, digits: int = 5) -> Any:
    """As lists, null for what is not finite."""
    array = np.round(np.asarray(array, dtype=float), digits)
    listed = array.astype(object)
    listed[~np.isfinite(array)] = None
    return listed.tolist()


def quaternions(rotations: Array) -> Array:
    """(w, x, y, z) [...×4] of rotation matrices [...×3×3], w ≥ 0: by the largest of the four, which is well away from 0."""
    R = rotations
    trace = np.trace(R, axis1=-2, axis2=-1)
    diagonal = np.diagonal(R, axis1=-2, axis2=-1)
    four = np.concatenate([trace[..., None], diagonal], axis=-1)      # 4 w² − 1, …
    squares = np.concatenate([(1 + trace)[..., None], 1 + 2 * diagonal - trace[..., None]], axis=-1)
    best = np.argmax(four, axis=-1)
    found = np.empty(R.shape[:-2] + (4,))
    off = {(0, 1): R[..., 2, 1] - R[..., 1, 2], (0, 2): R[..., 0, 2] - R[..., 2, 0],
           (0, 3): R[..., 1, 0] - R[..., 0, 1], (1, 2): R[..., 0, 1] + R[..., 1, 0],
           (1, 3): R[..., 0, 2] + R[..., 2, 0], (2, 3): R[..., 1, 2] + R[..., 2, 1]}
    for k in range(4):
        here = best == k
        root = np.sqrt(np.maximum(squares[..., k][here], 1e-12))
        for j in range(4):
            value = root if j == k else off[(min(j, k), max(j, k))][here] / root
            found[..., j][here] = 0.5 * value
    found *= np.where(found[..., :1] < 0, -1.0, 1.0)
    return found


def poses(robot: _core.Robot, q: Array) -> Array:
    """Positions and quaternions of the links [k×L×7]."""
    return np.concatenate([robot.link_positions(q), quaternions(robot.link_rotations(q))], axis=-1)


class Bodies:
    """The bodies of a model, as its coordinates name them: "left_foot_x", "body_pitch", or "x" of the one body."""

    def __init__(self, system: _core.System) -> None:
        self.system = system
        self.names: List[str] = []
        self.at: List[List[int]] = []       # of each, coordinates x, y, z; −1: none
        self.pitch: List[int] = []
        for k, name in enumerate(system.coordinates):
            body, _, axis = name.rpartition("_")
            if axis not in ("x", "y", "z", "pitch"):
                continue
            if body not in self.names:
                self.names.append(body)
                self.at.append([-1] * 3)
                self.pitch.append(-1)
            if axis == "pitch":
                self.pitch[self.names.index(body)] = k
            else:
                self.at[self.names.index(body)]["xyz".index(axis)] = k
        keep = [k for k, at in enumerate(self.at) if max(at) >= 0]
        self.names = [self.names[k] for k in keep]
        self.at = [self.at[k] for k in keep]
        self.pitch = [self.pitch[k] for k in keep]

    def axes(self) -> List[int]:
        """Of x, y, z those that any of them moves along."""
        return [axis for axis in range(3) if any(at[axis] >= 0 for at in self.at)]

    def rate(self, k: int) -> int:
        """The velocity of coordinate k; −1: none."""
        names = self.system.velocities
        return names.index(self.system.coordinates[k]) if k >= 0 and self.system.coordinates[k] in names else -1

    def positions(self, q: Array) -> Array:
        """[k×B×3]."""
        found = np.zeros((len(q), len(self.at), 3))
        for b, at in enumerate(self.at):
            for axis, k in enumerate(at):
                if k >= 0:
                    found[:, b, axis] = q[:, k]
        return found

    def poses(self, q: Array) -> Array:
        """[k×B×7]: pitch turns x towards z, in a plane x–y x towards y."""
        found = np.zeros((len(q), len(self.at), 7))
        found[..., :3] = self.positions(q)
        found[..., 3] = 1
        for b, k in enumerate(self.pitch):
            if k >= 0:
                upright = 2 in self.axes()
                found[:, b, 3] = np.cos(q[:, k] / 2)
                found[:, b, 5 if upright else 6] = (-1 if upright else 1) * np.sin(q[:, k] / 2)
        return found

    def contacts(self, x: Array, force: Array) -> Array:
        """Point and force [k×n×2×3] of each contact: on the body that its gap moves with most, λ ∂a/∂(its place),
        with friction that of the tangential rows is left out."""
        system, n = self.system, len(self.system.constraints)
        nq, where = system.num_positions, self.positions(x[:, :system.num_positions])
        moves = [[self.rate(k) for k in at] for at in self.at]
        found = np.full((len(x), n, 2, 3), np.nan)
        each: Any = zip(x, force)
        for row, (state, push) in enumerate(each):
            A = system.constraint_terms(state[:nq], state[nq:])[1][:n]
            for i in range(n):
                parts = np.array([[A[i, k] if k >= 0 else 0.0 for k in body] for body in moves])
                body = int(np.argmax(np.linalg.norm(parts, axis=1)))
                found[row, i, 0], found[row, i, 1] = where[row, body], push[i] * parts[body]
        return found

    def walls(self, q: Array, cells: int = 40) -> List[Any]:
        """Pieces [2×3] of the lines a_i = 0 in the plane of each body that moves in one, where nothing else moves a_i."""
        axes, found = self.axes(), []
        if len(axes) != 2:
            return []
        places = self.positions(q)[..., axes].reshape(-1, 2)
        middle = (places.min(axis=0) + places.max(axis=0)) / 2
        half = 0.7 * max(float(np.max(np.ptp(places, axis=0))), 0.5)
        grid = [np.linspace(m - half, m + half, cells + 1) for m in middle]
        for b, at in enumerate(self.at):
            own = [at[axis] for axis in axes]
            if min(own) < 0:
                continue
            gaps = np.empty((cells + 1, cells + 1, len(self.system.constraints)))
            point = q[0].copy()
            for i, u in enumerate(grid[0]):
                for j, v in enumerate(grid[1]):
                    point[own] = u, v
                    gaps[i, j] = self.system.gaps(point)[:gaps.shape[2]]
            A = self.system.constraint_terms(q[0], np.zeros(self.system.dof))[1]
            rates = {self.rate(k) for k in own}
            alone = [k for k in range(gaps.shape[2]) if set(np.flatnonzero(np.abs(A[k]) > 1e-12)) <= rates
                     and np.any(A[k])]
            for which in alone:
                for a, c in zero_lines(gaps[..., which]):
                    pieces = np.zeros((2, 3))
                    for end, cut in zip(pieces, (a, c)):
                        end[axes] = [np.interp(s, np.arange(cells + 1), line) for s, line in zip(cut, grid)]
                    found.append(numbers(pieces))
        return found


def zero_lines(values: Array) -> List[Tuple[Tuple[float, float], Tuple[float, float]]]:
    """Segments of the zero set of a function on a grid, in cells: where it changes its sign along two edges of one."""
    found = []
    for i in range(values.shape[0] - 1):
        for j in range(values.shape[1] - 1):
            corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            cuts = []
            for (a, b), (c, d) in zip(corners, corners[1:] + corners[:1]):
                one, other = values[a, b], values[c, d]
                if (one < 0) != (other < 0):
                    s = one / (one - other)
                    cuts.append((a + s * (c - a), b + s * (d - b)))
            if len(cuts) == 2:
                found.append((cuts[0], cuts[1]))
    return found


def ghosts(run: _core.Run, derivative: Dict[str, Any], where: Any) -> List[Dict[str, Any]]:
    """x(T) ⊞ size B(±w) for every direction that has one, as poses."""
    found: List[Dict[str, Any]] = []
    nq = run.system.num_positions
    for entry in derivative.get("directions", [])[:MAX_GHOSTS]:
        ghost: Dict[str, Any] = {"name": entry["name"]}
        for key in ("up", "down"):
            value = entry[key].get("value")
            if value is not None and None not in value:
                q = run.system.perturb(run.final_state, GHOST * np.array(value))[:nq]
                ghost[key] = numbers(where(q[None, :])[0])
        if len(ghost) > 1:
            found.append(ghost)
    return found


def scene(run: _core.Run, derivative: Dict[str, Any], frames: int = FRAMES) -> Dict[str, Any]:
    """All of it, at evenly spaced instants; empty where coordinates name no places."""
    system = run.system
    t = np.linspace(run.t_begin, run.t_end, frames)
    x, force = run.x(t), run.force(t)
    q = x[:, :system.num_positions]
    data: Dict[str, Any] = {"t": t.tolist(), "ghostSize": GHOST, "missing": []}
    if isinstance(system, _core.Robot):
        where: Any = lambda rows: poses(system, rows)   # noqa: E731
        placed = where(q)
        data["shapes"], data["missing"] = shapes(system)
        data["names"], data["parents"] = system.links, system.link_parents
        contacts = system.contact_forces(q, force)
        contacts[np.isnan(system.contact_points(q)[..., 0])] = np.nan    # limits of joints
        flat = placed[..., :3].reshape(-1, 3)
        middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
        half = max(0.75 * float(np.max(np.ptp(flat, axis=0))), 0.5)
        still = system.terrain(middle, half, 16)
        data["terrain"] = [numbers(patch, 4) for patch in still]
        data["moves"] = []
        if "clock" in system.coordinates:   # [k×3] of each patch
            there = [system.terrain(middle, half, 16, time) for time in q[:, system.coordinates.index("clock")]]
            data["moves"] = [numbers(np.array([now[i][0, 0] - patch[0, 0] for now in there]), 4) for i, patch in enumerate(still)]
        data["walls"], data["plane"] = [], ""
    else:
        bodies = Bodies(system)
        if not bodies.names:
            return {}
        where = bodies.poses
        placed = where(q)
        data["names"], data["parents"] = [n or system.name for n in bodies.names], [-1] * len(bodies.names)
        span = max(float(np.max(np.ptp(placed[..., :3].reshape(-1, 3), axis=0))), 0.2)
        data["shapes"] = [
            {"link": b, "kind": "box", "size": [0.18 * span, 0.05 * span, 0.03 * span], "at": [0, 0, 0],
             "turn": np.eye(3).ravel().tolist(), "colour": "#40505f"} if pitch >= 0 else
            {"link": b, "kind": "sphere", "size": [0.022 * span], "at": [0, 0, 0],
             "turn": np.eye(3).ravel().tolist(), "colour": "#40505f"} for b, pitch in enumerate(bodies.pitch)]
        contacts = bodies.contacts(x, force)
        data["terrain"], data["moves"], data["walls"] = [], [], bodies.walls(q)
        data["plane"] = "".join("xyz"[axis] for axis in bodies.axes())
    data["poses"] = numbers(placed)
    data["contacts"] = numbers(contacts.reshape(contacts.shape[:2] + (6,)))
    data["ghosts"] = ghosts(run, derivative, where)
    return data
