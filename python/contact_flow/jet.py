# SPDX-License-Identifier: BSD-3-Clause
"""Forward differentiation of formulas in Python: numbers that carry their derivatives.

A Jet is an element of L ⊗ (ℝ ⊕ ℝⁿε): its coefficients are a matrix [P × 1+n], column 0 the value and
the others the derivatives along n directions. L is one of

- the dual numbers ℝ ⊕ ℝᵐη (P = 1+m): derivatives along m more directions, and the mixed second ones;
- polynomials in s of degree < P (`series`): Taylor coefficients along a motion.

With P = 1 it is a dual number. Arrays of jets are numpy arrays of dtype object: +, −, *, /, **, @ and
np.sin, np.sqrt, … work on them; comparisons look at the value alone. There is no way to make a float of
a jet, so that what would drop a derivative (math.sin, an array of floats) is an error.
"""
from __future__ import annotations

import math
from typing import Any, Sequence, Tuple, Union

import numpy as np

Real = Union[int, float]


class Jet:
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
            return Jet(_product(self.c, other.c, self.series), self.series)
        return NotImplemented if not _is_real(other) else Jet(self.c * other, self.series)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, Jet):
            return self * other._inverse()
        return NotImplemented if not _is_real(other) else Jet(self.c / other, self.series)

    def __rtruediv__(self, other: Any) -> Any:
        return NotImplemented if not _is_real(other) else self._inverse() * other

    def _inverse(self) -> "Jet":
        y = 1.0 / self.value
        return self.chain(y, -y * y, 2 * y**3, -6 * y**4)

    def __pow__(self, exponent: Any) -> Any:
        if isinstance(exponent, Jet):
            return (self.log() * exponent).exp()
        if not _is_real(exponent):
            return NotImplemented
        x, n = self.value, exponent
        if x < 0 and n != int(n):   # not the complex number that Python has
            return self.chain(*[math.nan] * 4)
        slopes = []
        factor = 1.0
        for k in range(4):  # a factor of zero first: 0⁻¹ would come of x² at 0
            slopes.append(factor * _power(x, n - k) if factor != 0 else 0.0)
            factor *= n - k
        return self.chain(*slopes)

    def __rpow__(self, base: Any) -> Any:
        return NotImplemented if not _is_real(base) else (self * math.log(base)).exp()

    def __abs__(self) -> "Jet":
        return -self if self.value < 0 else self

    # Comparisons, of values

    def __lt__(self, other: Any) -> bool:
        return bool(self.value < _value(other))

    def __le__(self, other: Any) -> bool:
        return bool(self.value <= _value(other))

    def __gt__(self, other: Any) -> bool:
        return bool(self.value > _value(other))

    def __ge__(self, other: Any) -> bool:
        return bool(self.value >= _value(other))

    def __bool__(self) -> bool:
        return self.value != 0

    def __eq__(self, other: Any) -> bool:
        return bool(self.value == _value(other))

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
        delta = self.c.copy()
        delta[0, 0] = 0.0
        if not delta.any():
            return self.constant(slopes[0])
        if not all(math.isfinite(slope) for slope in slopes[1:order + 1]):
            return Jet(self._singular_chain(delta, slopes, order), self.series)
        c = slopes[1] * delta
        c[0, 0] = slopes[0]
        power, factorial = delta, 1
        for k in range(2, order + 1):
            power = _product(power, delta, self.series)
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
                    power = _product(power, delta, self.series)
                    pattern = _product(pattern, some, self.series)
                factorial *= k
                c = c + np.where(pattern > 0, (slopes[k] / factorial) * power, 0.0)
        c[0, 0] = slopes[0]
        return c

    def sqrt(self) -> "Jet":
        x = self.value
        if x == 0:
            return self.chain(0.0, math.inf, -math.inf, math.inf)
        y = math.sqrt(x)
        return self.chain(y, 0.5 / y, -0.25 / (x * y), 0.375 / (x * x * y))

    def sin(self) -> "Jet":
        s, c = math.sin(self.value), math.cos(self.value)
        return self.chain(s, c, -s, -c)

    def cos(self) -> "Jet":
        s, c = math.sin(self.value), math.cos(self.value)
        return self.chain(c, -s, -c, s)

    def tan(self) -> "Jet":
        t = math.tan(self.value)
        d = 1 + t * t
        return self.chain(t, d, 2 * t * d, 2 * d * (d + 2 * t * t))

    def exp(self) -> "Jet":
        e = math.exp(self.value)
        return self.chain(e, e, e, e)

    def log(self) -> "Jet":
        x = self.value
        return self.chain(math.log(x), 1 / x, -1 / x**2, 2 / x**3)

    def sinh(self) -> "Jet":
        s, c = math.sinh(self.value), math.cosh(self.value)
        return self.chain(s, c, s, c)

    def cosh(self) -> "Jet":
        s, c = math.sinh(self.value), math.cosh(self.value)
        return self.chain(c, s, c, s)

    def tanh(self) -> "Jet":
        t = math.tanh(self.value)
        d = 1 - t * t
        return self.chain(t, d, -2 * t * d, d * (6 * t * t - 2))

    def arcsin(self) -> "Jet":
        x = self.value
        r = 1 / math.sqrt(1 - x * x)
        return self.chain(math.asin(x), r, x * r**3, r**3 + 3 * x * x * r**5)

    def arccos(self) -> "Jet":
        angle: Jet = math.pi / 2 - self.arcsin()
        return angle

    def arctan(self) -> "Jet":
        x = self.value
        r = 1 / (1 + x * x)
        return self.chain(math.atan(x), r, -2 * x * r * r, (6 * x * x - 2) * r**3)

    def arctan2(self, other: Any) -> "Jet":
        """The angle of (other, self)."""
        x = other if isinstance(other, Jet) else self.constant(other)
        turn = math.atan2(self.value, x.value)
        if abs(x.value) >= abs(self.value):
            angle = (self / x).arctan()
        else:
            angle = -((x / self).arctan())
        turned: Jet = angle + (turn - angle.value)
        return turned

    def hypot(self, other: Any) -> "Jet":
        root: Jet = (self * self + other * other).sqrt()
        return root


def _power(x: float, n: float) -> float:
    """xⁿ, infinite at 0 for n < 0."""
    return math.inf if x == 0 and n < 0 else float(x ** n)


def _is_real(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating))


def _value(number: Any) -> Any:
    return number.value if isinstance(number, Jet) else number


def _row(a: Any, b: Any) -> Any:
    """The product of two dual numbers."""
    c = a * b[0] + b * a[0]
    c[0] = a[0] * b[0]
    return c


def _product(a: Any, b: Any, series: bool) -> Any:
    if a.shape[0] == 1:
        return _row(a[0], b[0])[np.newaxis, :]
    if series:
        c = np.zeros_like(a)
        for i in range(a.shape[0]):
            for j in range(a.shape[0] - i):
                c[i + j] += _row(a[i], b[j])
        return c
    c = a * b[0, 0] + b * a[0, 0]
    c[0, 0] = a[0, 0] * b[0, 0]
    c[1:, 1:] += np.outer(a[1:, 0], b[0, 1:]) + np.outer(b[1:, 0], a[0, 1:])
    return c


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
        else:
            c[index + (0, 0)] = number
    return c


def values(numbers: Any) -> Any:
    """The values of an array of jets and constants."""
    return np.array([_value(number) for number in numbers], dtype=float)
