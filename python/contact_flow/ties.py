# SPDX-License-Identifier: BSD-3-Clause
"""Where formulas decide on equal numbers: |x| at 0, max(x, x), np.where(x == 0, …), a norm of nothing.

Comparisons see values alone, so at a tie one branch is taken, which may have the derivative of one side, or of none.
Formulas that met a tie are therefore computed again as they are beside the point, along ±w for some directions w: each
tie falls as its two numbers differ along w, and a root of 0 has any slope. Where all of them have the same coefficients
these are the derivative, as of v |v| at rest. Else there is none, and Kink is raised instead of a number.
"""
from __future__ import annotations

import functools
import threading
from typing import Any, Callable, Optional, Tuple

import numpy as np

TURNS = (1, -1, 2, -2, 3, -3)   #: ± the number of a direction
TOLERANCE = 1e-9   #: what rounding may make of the same number, relative to the larger of 1 and it


class Kink(ArithmeticError):
    """Formulas have a kink or a jump where a derivative was asked for."""


class Watch:
    """One evaluation: at the point (turn 0) or beside it."""

    def __init__(self, turn: int) -> None:
        self.turn = turn
        self.met = ""   #: the first tie
        self.unknown = 0   #: numbers drawn for what no direction tells

    def draw(self, size: int) -> Any:
        self.unknown += 1
        return np.random.default_rng((self.turn + 8, self.unknown)).uniform(-1, 1, size)


class _Local(threading.local):
    watch: Optional[Watch] = None


_local = _Local()


@functools.lru_cache(maxsize=64)
def _direction(shape: Tuple[int, ...], number: int) -> Any:
    return np.random.default_rng((number, *shape)).normal(size=shape)


def side(delta: Any, what: str) -> int:
    """The sign of a number with these coefficients, whose value is 0: 0 at the point, ±1 beside it."""
    watch = _local.watch
    if watch is None:
        return 0
    watch.met = watch.met or what
    if watch.turn == 0:
        return 0
    along = float(np.sum(delta * _direction(delta.shape, abs(watch.turn))))
    if along == 0:   # it moves at a higher order, or not
        return 1 if watch.draw(1)[0] > 0 else -1
    return 1 if (along > 0) == (watch.turn > 0) else -1


def any_slopes(shape: Tuple[int, ...], what: str) -> Any:
    """Coefficients of what has infinite slope along nothing to first order, [0, 0] apart: any."""
    watch = _local.watch
    if watch is None:
        return np.full(shape, np.nan)
    watch.met = watch.met or what
    return np.zeros(shape) if watch.turn == 0 else watch.draw(int(np.prod(shape))).reshape(shape)


def _evaluate(evaluate: Callable[[], Any], watch: Watch) -> Any:
    before, _local.watch = _local.watch, watch
    try:
        return evaluate()
    finally:
        _local.watch = before


def settled(evaluate: Callable[[], Any], what: str, away: float = np.inf) -> Any:
    """The coefficients [… × P × 1+n] that evaluate() has, if they are those of a derivative.

    away: numbers that are larger than this may have a kink, and get the slope of one side. Raises Kink."""
    watch = Watch(0)
    found = _evaluate(evaluate, watch)
    values = found[..., 0, 0]
    judged = np.isfinite(values) & (np.abs(values) <= away)
    if watch.met:
        found[judged] = _beside(evaluate, found, judged, "%s decides here on %s, and beside this point" % (what, watch.met))
    if not np.isfinite(found).all() and not np.isfinite(found[judged]).all():
        raise Kink("%s has no finite derivative here" % what)
    return found


def _beside(evaluate: Callable[[], Any], found: Any, judged: Any, where: str) -> Any:
    """What is judged of the coefficients, as it is along all directions."""
    same: Any = None
    for turn in TURNS:
        try:
            with np.errstate(all="ignore"):
                beside = _evaluate(evaluate, Watch(turn))[judged]
        except (ArithmeticError, ValueError) as error:
            raise Kink("%s fails: %s" % (where, error)) from error
        if same is None:
            same, scale = beside, TOLERANCE * np.maximum(1.0, np.abs(beside))
            jump = np.abs(beside - found[judged])[:, 0, 0] > scale[:, 0, 0]
            if jump.any():
                raise Kink("%s it jumps: there is no derivative" % where)
        if not np.all(np.abs(beside - same) <= scale):
            raise Kink("%s its derivative is not everywhere the same, or not finite" % where)
    return same
