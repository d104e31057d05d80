# SPDX-License-Identifier: BSD-3-Clause
"""Forward differentiation of formulas in Python: numbers that carry their derivatives.

A Jet is an element of L ⊗ (ℝ ⊕ ℝⁿε): its coefficients are a matrix [P × 1+n], column 0 the value and
the others the derivatives along n directions. L is one of

- the dual numbers ℝ ⊕ ℝᵐη (P = 1+m): derivatives along m more directions, and the mixed second ones;
- polynomials in s of degree < P (`series`): Taylor coefficients along a motion.

With P = 1 it is a dual number. Arrays of jets are numpy arrays of dtype object: +, −, *, /, **, @ and
np.sin, np.sqrt, … work on them; comparisons look at the value alone, and say where values are equal that
need not be so beside (contact_flow.ties). There is no way to make a float of a jet, so that what would drop
a derivative (math.sin, an array of floats) is an error.
"""
from __future__ import annotations

import math
from typing import Any, Sequence, Tuple, Union

import numpy as np

from . import slopes as slopes_of
from .elementary import Elementary
from .ties import any_slopes, side
from .truncated import product

Real = Union[int, float]


class Jet(Elementary):
    """A number with derivatives; see the module."""

    __slots__ = ("c", "series")

    def __init__(self, c: Any, series: bool = False) -> None:
        self.c = c
        self.series = series

    @property
    def value(self) -> float:
        return float(self.c[0, 0])

    def constant(self, value: Real) -> "Jet":
        """A constant of the same kind."""
        c = np.zeros_like(self.c)
        c[0, 0] = value
        return Jet(c, self.series)

    def __repr__(self) -> str:
        return "Jet(%r, …)" % self.value

    # Sums

    def __neg__(self) -> "Jet":
        return Jet(-self.c, self.series)

    def __pos__(self) -> "Jet":
        return self

    def __add__(self, other: Any) -> Any:
        if isinstance(other, Jet):
            return Jet(self.c + other.c, self.series)
        if not _is_real(other):
            return NotImplemented
        c = self.c.copy()
        c[0, 0] += other
        return Jet(c, self.series)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        if isinstance(other, Jet):
            return Jet(self.c - other.c, self.series)
        return NotImplemented if not _is_real(other) else self + (-other)

    def __rsub__(self, other: Any) -> Any:
        return NotImplemented if not _is_real(other) else -self + other

    # Products

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Jet):
            return Jet(product(self.c, other.c, self.series), self.series)
        return NotImplemented if not _is_real(other) else Jet(self.c * other, self.series)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, Jet):
            return self * other._inverse()
        return NotImplemented if not _is_real(other) else Jet(self.c / other, self.series)

    def __rtruediv__(self, other: Any) -> Any:
        return NotImplemented if not _is_real(other) else self._inverse() * other

    def _inverse(self) -> "Jet":
        return self.chain(*slopes_of.inverse(self.value))

    def __pow__(self, exponent: Any) -> Any:
        if isinstance(exponent, Jet):
            return self._to_the(exponent)
        if not _is_real(exponent):
            return NotImplemented
        return self.chain(*slopes_of.power(self.value, exponent))

    def _to_the(self, exponent: "Jet") -> "Jet":
        if not exponent.delta().any():
            return self.chain(*slopes_of.power(self.value, exponent.value))
        if self.value > 0:
            power: Jet = (self.log() * exponent).exp()
            return power
        if self.value == 0 and exponent.value > 3:   # 0 to the third order
            return self.constant(0.0)
        return self._only(slopes_of.power(self.value, exponent.value)[0])

    def __rpow__(self, base: Any) -> Any:
        if not _is_real(base):
            return NotImplemented
        return self.constant(0.0) if base == 0 and self.value > 0 else self.constant(base)._to_the(self)

    def __abs__(self) -> "Jet":
        sign = self.value if self.value != 0 else side(self.delta(), "|x| of 0")
        return -self if sign < 0 else self

    # Comparisons, of values

    def _beyond(self, other: Any, what: str = "a comparison of equal numbers") -> float:
        """Of the sign of self − other; where they are equal, of that beside this point (ties)."""
        value: float = _value(other)
        if self.value != value:
            return self.value - value
        return side((self - other).delta(), what)

    def __lt__(self, other: Any) -> Any:
        return bool(self._beyond(other) < 0) if _is_number(other) else NotImplemented

    def __le__(self, other: Any) -> Any:
        return bool(self._beyond(other) <= 0) if _is_number(other) else NotImplemented

    def __gt__(self, other: Any) -> Any:
        return bool(self._beyond(other) > 0) if _is_number(other) else NotImplemented

    def __ge__(self, other: Any) -> Any:
        return bool(self._beyond(other) >= 0) if _is_number(other) else NotImplemented

    def __bool__(self) -> bool:
        return not self == 0

    def __eq__(self, other: Any) -> bool:
        if not _is_number(other):
            return NotImplemented
        return bool(self.value == _value(other) and self._beyond(other, "== of equal numbers") == 0)

    def __ne__(self, other: Any) -> bool:
        return not self == other

    __hash__ = None  # type: ignore[assignment]

    # Functions: np.sin of an array of jets calls sin() of each

    def chain(self, *slopes: float) -> "Jet":
        """g of this, given g, g′, g″, g‴ at the value: Σ g⁽ᵏ⁾ δᵏ / k!, δ nilpotent."""
        if self.series:
            order = self.c.shape[0]
        else:
            order = 1 if self.c.shape[0] == 1 else 2
        delta = self.delta()
        if not delta.any():
            if all(math.isfinite(slope) for slope in slopes[1:order + 1]):
                return self.constant(slopes[0])
            return Jet(any_slopes(delta.shape, "an infinite slope"), self.series)._with(slopes[0])
        if not all(math.isfinite(slope) for slope in slopes[1:order + 1]):
            return Jet(self._singular_chain(delta, slopes, order), self.series)
        c = slopes[1] * delta
        c[0, 0] = slopes[0]
        power, factorial = delta, 1
        for k in range(2, order + 1):
            power = product(power, delta, self.series)
            factorial *= k
            c = c + (slopes[k] / factorial) * power
        return Jet(c, self.series)

    def _singular_chain(self, delta: Any, slopes: Sequence[float], order: int) -> Any:
        """The same where a slope is not finite: an infinite one along nothing is nan, but for
        coefficients that δᵏ never has."""
        some = np.ones_like(delta)
        some[0, 0] = 0.0
        c, power, pattern, factorial = np.zeros_like(delta), delta, some, 1
        with np.errstate(invalid="ignore"):
            for k in range(1, order + 1):
                if k > 1:
                    power = product(power, delta, self.series)
                    pattern = product(pattern, some, self.series)
                factorial *= k
                c = c + np.where(pattern > 0, (slopes[k] / factorial) * power, 0.0)
        c[0, 0] = slopes[0]
        return c

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        if function is np.sinc:
            return self.sinc()
        return function._implementation(*args, **kwargs)   # numpy's own

    def delta(self) -> Any:
        """The coefficients but for the value."""
        delta = self.c.copy()
        delta[0, 0] = 0.0
        return delta

    def _only(self, value: float) -> "Jet":
        """A value, and no derivative."""
        return Jet(np.full_like(self.c, math.nan), self.series)._with(value)

    def _with(self, value: float) -> "Jet":
        self.c[0, 0] = value
        return self


def _is_real(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating))


def _is_number(value: Any) -> bool:
    return isinstance(value, Jet) or _is_real(value)


def _value(number: Any) -> Any:
    return number.value if isinstance(number, Jet) else number


def variables(values: Sequence[float], first: int, directions: int, left: int = 0,
              second: bool = False) -> Any:
    """Jets of `values`, the k-th with derivative 1 along direction first+k (none where first < 0) of
    `directions`, and where `second` along the k-th of the `left` directions of L."""
    jets = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        c = np.zeros((1 + left, 1 + directions))
        c[0, 0] = value
        if first >= 0:
            c[0, 1 + first + k] = 1.0
        if second:
            c[1 + k, 0] = 1.0
        jets[k] = Jet(c)
    jets.flags.writeable = False   # formulas do not change their arguments
    return jets


def motion(q: Sequence[float], v: Sequence[float], acceleration: Sequence[float],
           directions: int, by_state: bool) -> Any:
    """Series q + s v + s²/2 v̇, with derivatives along (q, v) where `by_state`."""
    jets = np.empty(len(q), dtype=object)
    for k, coefficients in enumerate(zip(q, v, acceleration)):
        c = np.zeros((3, 1 + directions))
        c[:, 0] = coefficients
        c[2, 0] *= 0.5
        if by_state:
            c[0, 1 + k] = 1.0
            c[1, 1 + len(q) + k] = 1.0
        jets[k] = Jet(c, True)
    jets.flags.writeable = False
    return jets


def coefficients(numbers: Any, shape: Tuple[int, int]) -> Any:
    """The coefficients of an array of jets and constants [… × P × 1+n]."""
    flat = np.asarray(numbers, dtype=object)
    c = np.zeros(flat.shape + shape)
    for index in np.ndindex(*flat.shape):
        number = flat[index]
        if isinstance(number, Jet):
            c[index] = number.c
        elif isinstance(number, (complex, np.complexfloating)):   # numpy would only warn
            raise TypeError("it has complex numbers")
        else:
            c[index + (0, 0)] = number
    return c


def values(numbers: Any) -> Any:
    """The values of an array of jets and constants."""
    return np.array([_value(number) for number in numbers], dtype=float)
