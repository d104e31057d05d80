# SPDX-License-Identifier: BSD-3-Clause
"""Where formulas decide on equal numbers: |x| at 0, max(x, x), np.where(x == 0, …), a norm of nothing.

Comparisons see values alone, so at a tie one branch is taken, which may have the derivative of one side, or of none.
Formulas that met a tie are therefore computed again as they are beside the point: a tie of two numbers whose difference
has the slope a falls by the sign of a·w for a displacement w, and each combination of signs that some w has is gone
through (a root of 0 has any slope). Where all of them have the same coefficients these are the derivative, as of v |v| at
rest. Else there is none, and Kink is raised instead of a number. Beyond MOST combinations those are seen in which one tie
falls the other way, then some at random.
"""
from __future__ import annotations

import threading
from typing import Any, Callable, List, Optional, Tuple

import numpy as np

MOST = 64   #: combinations
FEWEST = 3   #: evaluations beside a point, for slopes that are drawn
TOLERANCE = 1e-9   #: what rounding may make of the same number, relative to the largest coefficient of its formula
RESIDUAL = 1e-9   #: of directions of length 1, below which they have 0 in their hull


class Kink(ArithmeticError):
    """Formulas have a kink or a jump where a derivative was asked for."""


class Watch:
    """One evaluation: at the point (number 0) or beside it, where ties fall by `signs`, then as some w has it."""

    def __init__(self, number: int, signs: Tuple[int, ...] = ()) -> None:
        self.number = number
        self.met = ""   #: the first tie
        self.signs: List[int] = []   #: of all of them
        self.free: List[bool] = []   #: whether the other sign was possible, too
        self._given = signs
        self._slopes: List[Any] = []   #: times the signs, of those that were free
        self._basis: List[Any] = []   #: orthonormal, of these
        self._random: Any = None   #: made when it is first asked, which is seldom

    def draw(self, size: int) -> Any:
        self._random = self._random or np.random.default_rng(self.number)
        return self._random.uniform(-1, 1, size)

    def side(self, delta: Any) -> int:
        slope = _first_order(delta)
        length = float(np.linalg.norm(slope))
        if not np.isfinite(length):
            length = 0.0   # whatever it is
        possible = [1, -1]
        if length > 0 and not self._is_new(slope / length):
            possible = [sign for sign in possible if _have_a_side(self._slopes + [sign * slope / length])]
        k = len(self.signs)
        sign = self._given[k] if k < len(self._given) else possible[int(self.draw(1)[0] > 0) % len(possible)]
        self.signs.append(sign)
        self.free.append(len(possible) > 1)
        if length > 0 and len(possible) > 1:
            self._slopes.append(sign * slope / length)
        return sign

    def _is_new(self, slope: Any) -> bool:
        """Whether it is no combination of those before: then it has either sign, whatever theirs."""
        for _ in range(2):
            for one in self._basis:
                slope = slope - (one @ slope) * one
        length = float(np.linalg.norm(slope))
        if length > RESIDUAL:
            self._basis.append(slope / length)
        return length > RESIDUAL


class _Local(threading.local):
    watch: Optional[Watch] = None


_local = _Local()


def _first_order(delta: Any) -> Any:
    """Of the coefficients [P × 1+n] of a tie those that decide beside the point."""
    first = np.concatenate([delta[0, 1:], delta[1:2, 0]]) if delta.shape[0] == 3 else np.concatenate(
        [delta[0, 1:], delta[1:, 0]])
    return first if first.any() else delta.ravel()


def _have_a_side(slopes: List[Any]) -> bool:
    """Whether some w has a·w > 0 for all of them: no mean of theirs is 0 (Gordan). Least squares with weights ≥ 0."""
    A = np.vstack([np.array(slopes).T, np.ones(len(slopes))])
    weights: Any = np.zeros(len(slopes))
    used: Any = np.zeros(len(slopes), dtype=bool)
    goal = np.zeros(len(A))
    goal[-1] = 1.0
    for _ in range(10 * len(slopes)):
        rest = goal - A @ weights
        gain = np.where(used, -np.inf, A.T @ rest)
        if np.linalg.norm(rest) <= RESIDUAL or np.max(gain) <= 1e-14:   # rounding
            break
        used[int(np.argmax(gain))] = True
        while True:
            wanted = np.zeros(len(slopes))
            wanted[used] = np.linalg.lstsq(A[:, used], goal, rcond=None)[0]
            negative = used & (wanted <= 0)
            if not negative.any():
                break
            step = np.min(weights[negative] / (weights[negative] - wanted[negative]))
            weights = weights + step * (wanted - weights)
            used &= weights > 1e-15
        weights = wanted
    return bool(np.linalg.norm(goal - A @ weights) > RESIDUAL)


def side(delta: Any, what: str) -> int:
    """The sign of a number with these coefficients, whose value is 0: 0 at the point, ±1 beside it."""
    watch = _local.watch
    if watch is None:
        return 0
    watch.met = watch.met or what
    return 0 if watch.number == 0 else watch.side(delta)


def any_slopes(shape: Tuple[int, ...], what: str) -> Any:
    """Coefficients of what has infinite slope along nothing to first order, [0, 0] apart: any."""
    watch = _local.watch
    if watch is None:
        return np.full(shape, np.nan)
    watch.met = watch.met or what
    return np.zeros(shape) if watch.number == 0 else watch.draw(int(np.prod(shape))).reshape(shape)


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
        found[judged] = _beside(evaluate, found[judged], judged,
                                "%s decides here on %s, and beside this point" % (what, watch.met))
    if not np.isfinite(found).all() and not np.isfinite(found[judged]).all():
        raise Kink("%s has no finite derivative here" % what)
    return found


def _beside(evaluate: Callable[[], Any], found: Any, judged: Any, where: str) -> Any:
    """What is judged of the coefficients [k × P × 1+n], as it is everywhere beside the point."""
    same: Any = None
    left: List[Tuple[int, ...]] = [()]
    number = 0
    while (left or number < FEWEST) and number < MOST:
        number += 1
        watch = Watch(number, left.pop(0) if left else ())
        given = len(watch._given)
        try:
            with np.errstate(all="ignore"):
                beside = _evaluate(evaluate, watch)[judged]
        except (ArithmeticError, ValueError) as error:
            raise Kink("%s fails: %s" % (where, error)) from error
        left += [(*watch.signs[:k], -watch.signs[k]) for k in range(given, len(watch.signs)) if watch.free[k]]
        if same is None:
            same = beside
            largest = np.max(np.abs(beside), axis=(1, 2), initial=0.0)
            scale = TOLERANCE * np.maximum(largest, 1e-4 * np.max(largest, initial=0.0))[:, None, None]
            if np.any(np.abs(beside - found)[:, 0, 0] > scale[:, 0, 0]):
                raise Kink("%s it jumps: there is no derivative" % where)
        if not np.all(np.abs(beside - same) <= scale):
            raise Kink("%s its derivative is not everywhere the same, or not finite" % where)
    return same
