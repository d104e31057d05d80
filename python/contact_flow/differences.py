# SPDX-License-Identifier: BSD-3-Clause
"""The coefficients of contact_flow.jet by differences of values, for formulas that duals do not pass through.

Central differences of sixth order: seven points, ± 3 steps, which are twice as long for second and third derivatives.
Errors are those of rounding, 1e-16 of the values over stepᵏ for the k-th derivative, and step⁶ of what the formulas do at
a higher rate. Those of fourth order, of the same values, are beside them: where the two differ, by first or by second
differences (a kink in the middle is even), a kink or a quick change is near, and nothing is answered. Nor where the
slopes along some sums of the directions are not the sums of theirs, as of max(0, min(x, y)) at 0.
"""
from __future__ import annotations

from typing import Any, Callable, Sequence, Tuple

import numpy as np

from . import jet
from .model_checks import floats

#: what fourth and sixth order may differ by, relative to how much the value changes within a step: where it does so at a
#: rate r, step r is below (30 TOLERANCE)^(1/4) then, and the error of sixth order, (step r)⁶/140 of the slope, below 2e-9
TOLERANCE = 1e-6
OTHERS = 0.1   #: of the largest such change of any value, which counts for all of them
ROUNDING = 2e-13   #: of the largest value, what rounding may make of differences
DIAGONALS = 4   #: sums of directions: all of them, and with some signs
POINTS = np.arange(-3, 4)
FIRST = np.array([[-1, 9, -45, 0, 45, -9, 1], [0, 5, -40, 0, 40, -5, 0]]) / 60
SECOND = np.array([[2, -27, 270, -490, 270, -27, 2], [0, -15, 240, -450, 240, -15, 0]]) / 180


class Uncertain(ArithmeticError):
    """Differences do not tell a derivative."""


def coefficients(f: Callable[..., Any], arguments: Sequence[Any], scales: Sequence[Any], shape: Tuple[int, int],
                 series: bool, step: float, what: str) -> Any:
    """The coefficients [… × P × 1+n] that f of these arguments, arrays of jets and numbers, would have.

    step: displacement of an argument from one point to the next, in units of its `scales`. Raises Uncertain."""
    sizes = [len(a) for a in arguments]
    c = np.concatenate([jet.coefficients(a, shape) for a in arguments])
    scale = np.concatenate([np.broadcast_to(np.asarray(s, dtype=float), (n,)) for s, n in zip(scales, sizes)])
    ends = np.cumsum(sizes)[:-1]

    def value(x: Any) -> Any:
        x.flags.writeable = False   # formulas do not change their arguments
        return floats(f(*np.split(x, ends)), what)

    def reach(direction: Any) -> float:
        """The factor that makes a direction as long as a step."""
        size = float(np.max(np.abs(direction) / scale, initial=0.0))
        return step / size if size > 0 else 1.0
    found, apart, change, size = (_series if series else _duals)(value, c, reach)
    allowed = TOLERANCE * np.maximum(change, OTHERS * np.max(change, initial=0.0)) + ROUNDING * size
    if not np.all(apart <= allowed):
        raise Uncertain("%s changes too fast for differences of %g, or has a kink here: fourth and sixth order, or "
                        "differences and their sums, differ by %.2g" % (what, step, float(np.max(apart)) / step))
    return found


class _Judge:
    """How far apart two ways to see the same difference are, and how much values change from one point to the next."""

    def __init__(self, base: Any) -> None:
        self.apart, self.change, self.size = np.zeros(base.shape), np.zeros(base.shape), _largest(base)

    def differ(self, *some: Any) -> None:
        for one in some:
            self.apart = np.maximum(self.apart, np.abs(one))   # nan stays

    def see(self, values: Any) -> None:
        """Values at the points [7 × …]."""
        self.change = np.maximum(self.change, np.max(np.abs(values - values[3]), axis=0) / 3)
        self.size = max(self.size, _largest(values))


def _largest(array: Any) -> float:
    return float(np.max(np.abs(array), initial=0.0))


def _apart(weights: Any, values: Any) -> Tuple[Any, Any]:
    """The difference of sixth order of values at the points [7 × …], and how far that of fourth is from it."""
    six, four = np.tensordot(weights, values, 1)
    return six, six - four


def _duals(value: Callable[[Any], Any], c: Any, reach: Callable[[Any], float]) -> Tuple[Any, Any, Any, float]:
    """Coefficients, and what judges them; second derivatives are those along sums and differences of directions."""
    base, rows, cols = value(c[:, 0, 0]), c.shape[1], c.shape[2]
    found = np.zeros(base.shape + (rows, cols))
    found[..., 0, 0] = base
    judge, nothing = _Judge(base), np.zeros(len(c))

    def along(direction: Any, bend: Any) -> Any:
        """f(x + k direction + k² bend) at the points [7 × …]."""
        return np.array([base if k == 0 else value(c[:, 0, 0] + k * direction + k * k * bend) for k in POINTS])
    steps, firsts = [], []
    for i, j in [(i, 0) for i in range(1, rows)] + [(0, j) for j in range(1, cols)]:
        if c[:, i, j].any():
            h = reach(c[:, i, j])
            values = along(h * c[:, i, j], nothing)
            first, apart = _apart(FIRST, values)
            found[..., i, j] = first / h
            judge.see(values)
            judge.differ(apart, _apart(SECOND, values)[1])
            steps.append(h * c[:, i, j])
            firsts.append(first)
    signs = np.random.default_rng(0)
    for sign in [np.ones(len(steps))] + [signs.choice([-1.0, 1.0], len(steps)) for _ in range(1, DIAGONALS)]:
        if len(steps) > 1:   # as long as a step in all
            values = along(np.tensordot(sign, steps, 1) / len(steps), nothing)
            first, apart = _apart(FIRST, values)
            sums = np.tensordot(sign, firsts, 1) / len(steps)
            judge.differ(len(steps) * apart, len(steps) * _apart(SECOND, values)[1], len(steps) * (first - sums))
    for i in range(1, rows):
        for j in range(1, cols):
            a, b = 2 * reach(c[:, i, 0]), 2 * reach(c[:, 0, j])
            one, other, bend = a * c[:, i, 0], b * c[:, 0, j], a * b * c[:, i, j]
            if (one.any() and other.any()) or bend.any():
                second, apart = _apart(SECOND, along(one + other, bend) - along(one - other, -bend))
                found[..., i, j] = second / (4 * a * b)
                judge.differ(apart / 8)
    return found, judge.apart, judge.change, judge.size


def _series(value: Callable[[Any], Any], c: Any, reach: Callable[[Any], float]) -> Tuple[Any, Any, Any, float]:
    """The same along a motion: Taylor coefficients, and their derivatives along the directions."""
    speed, bend = 2 * reach(c[:, 1, 0]), (reach(c[:, 2, 0]) / 30) ** 0.5   # along which a motion bends little
    moving = [h for h, some in ((speed, c[:, 1, 0].any()), (bend, c[:, 2, 0].any())) if some]
    h = min(moving) if moving else 1.0
    powers = (h * POINTS[:, None]) ** np.arange(3)[None, :]   # [7×3]
    base = np.array([value(c[:, :, 0] @ p) for p in powers])
    found = np.zeros(base.shape[1:] + (3, c.shape[2]))
    judge = _Judge(base[3])

    def taylor(values: Any) -> Tuple[Any, Any, Any]:
        """Of values at the points [7 × …]: coefficients [… × 3], and how far fourth order is from them."""
        (first, apart), (second, also) = _apart(FIRST, values), _apart(SECOND, values)
        return np.stack([values[3], first / h, second / (2 * h * h)], axis=-1), apart, also
    found[..., 0], *apart = taylor(base)
    judge.see(base)
    judge.differ(apart[0] / 2, apart[1] / 2)
    for j in range(1, c.shape[2]):
        if not c[:, :, j].any():
            continue
        e = 2 * min(reach(c[:, :, j] @ p) for p in powers if (c[:, :, j] @ p).any())
        beside = np.array([[base[k] if m == 0 else value((c[:, :, 0] + m * e * c[:, :, j]) @ p)
                            for k, p in enumerate(powers)] for m in POINTS])   # [7 × 7 × …]
        slopes, apart_of_j = _apart(FIRST, beside)
        coefficients_of_j, *apart = taylor(slopes)
        found[..., j] = coefficients_of_j / e
        for one in (apart_of_j, _apart(SECOND, beside)[1]):
            judge.differ(*(one / 2))
        judge.differ(apart[0] / 2, apart[1] / 2)
        for of_one in np.moveaxis(beside, 1, 0):
            judge.see(of_one)
    return found, judge.apart, judge.change, judge.size
