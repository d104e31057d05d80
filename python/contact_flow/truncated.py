# SPDX-License-Identifier: BSD-3-Clause
"""Products of coefficients [P × 1+n] of jets (contact_flow.jet)."""
from __future__ import annotations

from typing import Any

import numpy as np


def _row(a: Any, b: Any) -> Any:
    """The product of two dual numbers."""
    c = a * b[0] + b * a[0]
    c[0] = a[0] * b[0]
    return c


def product(a: Any, b: Any, series: bool) -> Any:
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
