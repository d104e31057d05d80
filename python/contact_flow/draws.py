# SPDX-License-Identifier: BSD-3-Clause
"""What the runs of an ensemble differ in: distributions of numbers by name.

A name is that of a coordinate, of a velocity behind "d/dt ", of an input or of a parameter, and what is
drawn its value; behind a "+" it is what is added to the start (in its tangent chart), the input or the
parameter.

>>> [part["kind"] for part in parts_of({"body_pitch": Uniform(-0.3, 0.3), "stiffness": [25, 27, 30]})]
['uniform', 'grid']
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Sequence, Union

import numpy as np

Part = Dict[str, Any]


@dataclass(frozen=True)
class Uniform:
    """A number in [low, high)."""

    low: float
    high: float


@dataclass(frozen=True)
class Normal:
    """A normal number with this mean and standard deviation."""

    mean: float
    std: float


@dataclass(frozen=True)
class JointNormal:
    """Normal numbers with a covariance [k×k]; `mean` [k] is 0 unless given."""

    names: Sequence[str]
    covariance: Any
    mean: Any = None


@dataclass(frozen=True)
class Table:
    """Numbers row by row [rows×k], from the first again after the last."""

    names: Sequence[str]
    rows: Any


#: By name: a distribution, or the levels of a grid. Several, and joint ones, as a list.
Draw = Union[Mapping[str, Any], JointNormal, Table]
Draws = Union[Draw, Sequence[Draw]]


def floats(values: Any) -> Any:
    """Nested lists of numbers, as JSON has them."""
    return np.asarray(values, dtype=float).tolist()


def part_of(name: str, draw: Any) -> Part:
    if isinstance(draw, Uniform):
        return {"kind": "uniform", "names": [name], "low": [float(draw.low)], "high": [float(draw.high)]}
    if isinstance(draw, Normal):
        if not draw.std >= 0:
            raise ValueError("the standard deviation of '%s' is %r, expected a number >= 0" % (name, draw.std))
        if draw.std > 0 and not 0 < float(draw.std) ** 2 < float("inf"):
            raise ValueError("the standard deviation of '%s' is %r, whose square is no number" % (name, draw.std))
        return {"kind": "normal", "names": [name], "mean": [float(draw.mean)],
                "covariance": [[float(draw.std) ** 2]]}
    if isinstance(draw, (str, bytes, Mapping, JointNormal, Table)):
        raise TypeError("'%s' is drawn from %r, expected Uniform, Normal or the levels of a grid" % (name, draw))
    return {"kind": "grid", "names": [name], "levels": [floats(np.atleast_1d(np.asarray(draw, dtype=float)))]}


def parts_of(draws: Draws) -> List[Part]:
    """Plain values that say the same: what requests and stores hold."""
    if isinstance(draws, JointNormal):
        names = list(draws.names)
        mean = np.zeros(len(names)) if draws.mean is None else draws.mean
        return [{"kind": "normal", "names": names, "mean": floats(mean), "covariance": floats(draws.covariance)}]
    if isinstance(draws, Table):
        return [{"kind": "table", "names": list(draws.names), "table": floats(draws.rows)}]
    if isinstance(draws, Mapping):
        return [part_of(name, draw) for name, draw in draws.items()]
    return [part for one in draws for part in parts_of(one)]
