#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
#
# A model in Python: a ball on an elastic string above a slope. Equations are all that is written;
# Coriolis terms, gradients of gaps and derivatives by state and parameters follow from them.
#
# Prints: slope of the errors over the perturbations: 1.00

from typing import Any, Tuple

import numpy as np

import contact_flow as cf


class BallOnAString(cf.Formulas):
    """A point mass on a string that pulls once it is long, and a slope it bounces on."""

    coordinates = ("x", "z")
    units = ("m", "m")
    constraints = ("slope",)
    parameters = {"mass": (0.5, "kg", "of the ball", "positive"),
                  "stiffness": (5.0, "N/m", "of the string"),
                  "incline": (0.2, "rad", "of the slope"),
                  "restitution": (0.7, "", "of its bounces", "unit_interval")}
    constant_mass = True

    mass: float
    stiffness: float
    incline: float

    def mass_matrix(self, q: Any) -> Any:
        return [[self.mass, 0], [0, self.mass]]

    def force(self, q: Any, v: Any, u: Any) -> Any:
        distance = np.hypot(q[0], q[1] - 2.0)
        pull = self.stiffness * (distance - 1.0) / distance
        return [-pull * q[0], -pull * (q[1] - 2.0) - 9.81 * self.mass]

    def gaps(self, q: Any) -> Any:
        return [q[1] * np.cos(self.incline) - q[0] * np.sin(self.incline)]

    def nominal(self) -> Tuple[Any, Any, float]:
        return [0.1, 0.5, 0.5, -1.5], [], 0.8


ball = cf.PythonModel(BallOnAString)
run = ball.simulate()
print(run)
B = run.derivative(by=["parameters"])
report = B.compare({"z": 1, "d/dt x": 0.5, "stiffness": 3, "incline": 0.1}, [1e-3, 1e-4, 1e-5])
print("slope of the errors over the perturbations: %.2f" % report.slope)
