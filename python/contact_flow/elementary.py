# SPDX-License-Identifier: BSD-3-Clause
"""Functions that jets pass through: np.sin of an array of jets calls sin() of each."""
from __future__ import annotations

import math
from typing import Any, Callable

from . import slopes
from .ties import side


def _of(function: Callable[[float], slopes.Slopes]) -> Callable[[Any], Any]:
    def composed(jet: Any) -> Any:
        return jet.chain(*function(jet.value))
    return composed


class Elementary:
    """What contact_flow.jet.Jet has of functions by their numpy names."""

    __slots__ = ()

    sqrt, cbrt = _of(slopes.sqrt), _of(slopes.cbrt)
    exp, expm1, log, log1p = _of(slopes.exp), _of(slopes.expm1), _of(slopes.log), _of(slopes.log1p)
    sin, cos, tan, sinc = _of(slopes.sin), _of(slopes.cos), _of(slopes.tan), _of(slopes.sinc)
    arcsin, arctan = _of(slopes.arcsin), _of(slopes.arctan)
    sinh, cosh, tanh = _of(slopes.sinh), _of(slopes.cosh), _of(slopes.tanh)
    arcsinh, arccosh, arctanh = _of(slopes.arcsinh), _of(slopes.arccosh), _of(slopes.arctanh)

    def exp2(self: Any) -> Any:
        return 2.0 ** self

    def log2(self: Any) -> Any:
        return self.log() / math.log(2)

    def log10(self: Any) -> Any:
        return self.log() / math.log(10)

    def arccos(self: Any) -> Any:
        return math.pi / 2 - self.arcsin()

    def radians(self: Any) -> Any:
        return self * (math.pi / 180)

    def degrees(self: Any) -> Any:
        return self * (180 / math.pi)

    deg2rad, rad2deg = radians, degrees

    def fabs(self: Any) -> Any:
        return abs(self)

    def conjugate(self: Any) -> Any:
        return self

    def arctan2(self: Any, other: Any) -> Any:
        """The angle of (other, self); it jumps where self = 0 and other < 0."""
        x: Any = other if isinstance(other, Elementary) else self.constant(other)
        turn = math.atan2(self.value, x.value)
        if self.value == 0 and x.value == 0:
            return self._only(turn)
        if self.value == 0 and x.value < 0:
            turn = math.copysign(turn, side(self.delta(), "an angle of half a turn") or turn)
        if abs(x.value) >= abs(self.value):
            angle = (self / x).arctan()
        else:
            angle = -((x / self).arctan())
        return angle + (turn - angle.value)

    def hypot(self: Any, other: Any) -> Any:
        return (self * self + other * other).sqrt()
