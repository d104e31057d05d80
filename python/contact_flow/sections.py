# SPDX-License-Identifier: BSD-3-Clause
"""Inputs on a grid, and sections of return maps: plain values, by names."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Mapping, Tuple

import numpy as np


class Grid:
    """An input that is constant on intervals: U[k] from t[k] on, up to t[k+1].

    >>> Grid([0, 0.5], [[1.0], [2.0]])
    Grid(2 instants from 0 to 0.5 s, 1 input)
    """

    def __init__(self, t: Any, u: Any) -> None:
        self.t = np.array(t, dtype=float, ndmin=1)  #: [K], increasing [s]
        self.u = np.array(u, dtype=float)  #: [K×m]
        if self.u.ndim == 1:
            self.u = self.u.reshape((len(self.t), -1)) if len(self.t) else self.u.reshape((0, 0))
        if self.t.ndim != 1 or self.u.ndim != 2 or len(self.t) != len(self.u):
            raise ValueError("t has shape %s and u %s, expected [K] and [K×m]"
                             % (self.t.shape, self.u.shape))

    def __repr__(self) -> str:
        return "Grid(%d instants from %g to %g s, %d input%s)" % (
            len(self.t), self.t[0] if len(self.t) else 0, self.t[-1] if len(self.t) else 0,
            self.u.shape[1], "" if self.u.shape[1] == 1 else "s")


@dataclass(frozen=True)
class Section:
    """Where a return map is taken; made by Crossing, Apex, Touchdown and After. `shifted`: numbers by the
    names of coordinates, which are added to the return before it is compared with the start."""

    kind: str
    name: str = ""
    value: float = 0.0
    sign: int = 0
    shifted: Tuple[Tuple[str, float], ...] = ()


def _pairs(shifted: Mapping[str, float]) -> Tuple[Tuple[str, float], ...]:
    return tuple((str(name), float(amount)) for name, amount in dict(shifted).items())


def Crossing(name: str, value: float = 0.0, sign: int = 0, *, shifted: Mapping[str, float] = {}) -> Section:
    """Where a coordinate passes `value`, or, for a name that begins with 'd/dt ', a velocity does.
    sign +1: it rises, −1: it falls, 0: either.

    >>> Crossing('d/dt body_z', sign=-1, shifted={'clock': -0.5})
    Section(kind='velocity', name='body_z', value=0.0, sign=-1, shifted=(('clock', -0.5),))
    """
    if not math.isfinite(value):
        raise ValueError("value is %r, expected a number that is finite" % (value,))
    if sign not in (-1, 0, 1):
        raise ValueError("sign is %r, expected -1, 0 or 1" % (sign,))
    if name.startswith("d/dt "):
        return Section("velocity", name[len("d/dt "):], float(value), sign, _pairs(shifted))
    return Section("coordinate", name, float(value), sign, _pairs(shifted))


def Apex(coordinate: str, *, shifted: Mapping[str, float] = {}) -> Section:
    """Where the velocity of a coordinate falls through zero."""
    return Section("velocity", coordinate, 0.0, -1, _pairs(shifted))


def Touchdown(constraint: str, *, shifted: Mapping[str, float] = {}) -> Section:
    """Just behind the impact of a contact."""
    return Section("event", constraint, shifted=_pairs(shifted))


def After(seconds: float, *, shifted: Mapping[str, float] = {}) -> Section:
    """After some seconds, whatever the state."""
    if not (math.isfinite(seconds) and seconds > 0):
        raise ValueError("seconds is %r, expected a number > 0" % (seconds,))
    return Section("time", "", float(seconds), 0, _pairs(shifted))
