# SPDX-License-Identifier: BSD-3-Clause
"""(g, g′, g″, g‴) at a number, of the functions that jets pass through.

Values are those of numpy: nan outside the domain, ±inf at a pole. A slope that does not exist is not finite.
"""
from __future__ import annotations

import functools
import math
from typing import Callable, Tuple

Slopes = Tuple[float, float, float, float]


def _as_numpy(function: Callable[[float], Slopes]) -> Callable[[float], Slopes]:
    @functools.wraps(function)
    def slopes(x: float) -> Slopes:
        try:
            return function(x)
        except ValueError:
            return math.nan, math.nan, math.nan, math.nan
        except OverflowError:
            return math.inf, math.nan, math.nan, math.nan
    return slopes


@_as_numpy
def inverse(x: float) -> Slopes:
    if x == 0:
        return math.copysign(math.inf, x), math.nan, math.nan, math.nan
    y = 1.0 / x
    return y, -y * y, 2 * y**3, -6 * y**4


@_as_numpy
def sqrt(x: float) -> Slopes:
    if x == 0:
        return 0.0, math.inf, -math.inf, math.inf
    y = math.sqrt(x)
    return y, 0.5 / y, -0.25 / (x * y), 0.375 / (x * x * y)


@_as_numpy
def sin(x: float) -> Slopes:
    s, c = math.sin(x), math.cos(x)
    return s, c, -s, -c


@_as_numpy
def cos(x: float) -> Slopes:
    s, c = math.sin(x), math.cos(x)
    return c, -s, -c, s


@_as_numpy
def tan(x: float) -> Slopes:
    t = math.tan(x)
    d = 1 + t * t
    return t, d, 2 * t * d, 2 * d * (d + 2 * t * t)


@_as_numpy
def sinc(x: float) -> Slopes:
    """sin(π x)/(π x), 1 at 0. Of y = π x: near 0 the series Σ (−1)ᵏ y²ᵏ/(2k+1)!, else what follows of y h = sin y."""
    y = math.pi * x
    if abs(y) < 1:
        h = [0.0] * 4
        for k in range(11):   # 1/23! of what is left out
            factor = (-1.0) ** k / math.factorial(2 * k + 1)
            for order in range(min(4, 2 * k + 1)):
                h[order] += factor * math.perm(2 * k, order) * y ** (2 * k - order)
    else:
        h = [math.sin(y) / y]
        h.append((math.cos(y) - h[0]) / y)
        h.append(-h[0] - 2 * h[1] / y)
        h.append(-h[1] - (h[0] + 3 * h[2]) / y)
    return h[0], math.pi * h[1], math.pi**2 * h[2], math.pi**3 * h[3]


@_as_numpy
def exp(x: float) -> Slopes:
    e = math.exp(x)
    return e, e, e, e


@_as_numpy
def log(x: float) -> Slopes:
    if x == 0:
        return -math.inf, math.inf, -math.inf, math.inf
    return math.log(x), 1 / x, -1 / x**2, 2 / x**3


@_as_numpy
def expm1(x: float) -> Slopes:
    e = math.exp(x)
    return math.expm1(x), e, e, e


@_as_numpy
def log1p(x: float) -> Slopes:
    if x == -1:
        return -math.inf, math.inf, -math.inf, math.inf
    r = 1 / (1 + x)
    return math.log1p(x), r, -r * r, 2 * r**3


@_as_numpy
def cbrt(x: float) -> Slopes:
    if x == 0:
        return x, math.inf, math.nan, math.inf
    y = math.copysign(abs(x) ** (1 / 3), x)
    y -= (y - x / (y * y)) / 3   # Newton: the power is off by some last digits
    return y, y / (3 * x), -2 * y / (9 * x * x), 10 * y / (27 * x**3)


@_as_numpy
def sinh(x: float) -> Slopes:
    s, c = math.sinh(x), math.cosh(x)
    return s, c, s, c


@_as_numpy
def cosh(x: float) -> Slopes:
    s, c = math.sinh(x), math.cosh(x)
    return c, s, c, s


@_as_numpy
def tanh(x: float) -> Slopes:
    t = math.tanh(x)
    d = 1 - t * t
    return t, d, -2 * t * d, d * (6 * t * t - 2)


@_as_numpy
def arcsin(x: float) -> Slopes:
    angle = math.asin(x)
    if abs(x) == 1:
        return angle, math.inf, math.copysign(math.inf, x), math.inf
    r = 1 / math.sqrt((1 - x) * (1 + x))
    return angle, r, x * r**3, r**3 + 3 * x * x * r**5


@_as_numpy
def arctan(x: float) -> Slopes:
    r = 1 / (1 + x * x)
    return math.atan(x), r, -2 * x * r * r, (6 * x * x - 2) * r**3


@_as_numpy
def arcsinh(x: float) -> Slopes:
    r = 1 / math.hypot(1, x)
    return math.asinh(x), r, -x * r**3, (2 * x * x - 1) * r**5


@_as_numpy
def arccosh(x: float) -> Slopes:
    if x == 1:
        return 0.0, math.inf, -math.inf, math.inf
    r = 1 / math.sqrt((x - 1) * (x + 1))
    return math.acosh(x), r, -x * r**3, (2 * x * x + 1) * r**5


@_as_numpy
def arctanh(x: float) -> Slopes:
    if abs(x) == 1:
        return math.copysign(math.inf, x), math.nan, math.nan, math.nan
    r = 1 / ((1 - x) * (1 + x))
    return math.atanh(x), r, 2 * x * r * r, (2 + 6 * x * x) * r**3


def power(x: float, n: float) -> Slopes:
    """Of xⁿ. A factor of zero first: 0⁻¹ would come of x² at 0."""
    if x < 0 and n != int(n):   # not the complex number that Python has
        return math.nan, math.nan, math.nan, math.nan
    found = []
    factor = 1.0
    for k in range(4):
        found.append(factor * _power(x, n - k) if factor != 0 else 0.0)
        factor *= n - k
    return found[0], found[1], found[2], found[3]


def _power(x: float, n: float) -> float:
    """xⁿ, infinite at 0 for n < 0, and where it is too large."""
    if x == 0 and n < 0:
        return math.inf
    try:
        return float(x ** n)
    except OverflowError:
        return math.inf if x > 0 or n % 2 == 0 else -math.inf
