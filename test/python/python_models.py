# SPDX-License-Identifier: BSD-3-Clause
"""Models in Python for the tests."""
import numpy as np

import contact_flow as cf


class SoftBiped(cf.Formulas):
    """The model soft_biped of C++."""

    name = "soft_biped_in_python"
    coordinates = ("body_x", "left_foot_x", "right_foot_x", "body_z", "left_foot_z", "right_foot_z",
                   "body_pitch")
    units = ("m",) * 6 + ("rad",)
    constraints = ("left_foot", "right_foot")
    parameters = {
        "body_mass": (1, "kg", "mass of the body", "positive"), "foot_mass": (1, "kg", "of each foot"),
        "body_inertia": (1, "kg m^2", "about its centre"), "gravity": (1, "m/s^2", "downward"),
        "leg_length": (0.5, "m", "rest length"), "hip_offset": (0.25, "m", "from the centre to a hip"),
        "stiffness": (27, "N/m", "of a leg"), "flywheel": 1.5}

    def mass_matrix(self, q):
        m, f = self.body_mass, self.foot_mass
        return np.diag([m, f, f, m, f, f, self.body_inertia])

    def force(self, q, v, u):
        c, s = np.cos(q[6]), np.sin(q[6])
        body_x, body_z = 0.0, -self.body_mass * self.gravity
        torque = self.flywheel * (v[4] - v[5]) ** 2
        feet_x, feet_z = [], []
        for leg, offset in enumerate((-self.hip_offset, self.hip_offset)):
            arm_x, arm_z = offset * c, offset * s
            dx, dz = q[0] + arm_x - q[1 + leg], q[3] + arm_z - q[4 + leg]
            tension = self.stiffness * (self.leg_length / np.sqrt(dx * dx + dz * dz) - 1.0)
            body_x += tension * dx
            body_z += tension * dz
            torque += arm_x * tension * dz - arm_z * tension * dx
            feet_x.append(-tension * dx)
            feet_z.append(-tension * dz - self.foot_mass * self.gravity)
        return [body_x, *feet_x, body_z, *feet_z, torque]

    def gaps(self, q):
        return [q[4], q[5]]

    def nominal(self):
        x = np.zeros(14)
        x[1:6] = -self.hip_offset, self.hip_offset, 0.5 + self.leg_length, 0.5, 0.5
        return x, [], 1.4


class Wheel(cf.Formulas):
    """A disc with a weight off its centre over a wavy ground, drawn to a bent rail: M, gap and closure
    bend, every parameter matters. Nothing is known of it but its equations."""

    coordinates = ("x", "z", "angle")
    units = ("m", "m", "rad")
    constraints = ("rim",)
    inputs = ("torque",)
    parameters = {"mass": 1.0, "offset": 0.2, "inertia": 0.3, "gravity": 3.0, "height": 0.1,
                  "bounce": 0.4, "damping": 0.1}

    def mass_matrix(self, q):
        c, s = np.cos(q[2]), np.sin(q[2])
        m, e = self.mass, self.offset
        return [[m, 0, -m * e * s], [0, m, m * e * c], [-m * e * s, m * e * c, self.inertia + m * e**2]]

    def force(self, q, v, u):
        weight = self.mass * self.gravity
        return [-self.damping * v[0] * v[2], -weight,
                u[0] - weight * self.offset * np.cos(q[2]) - self.damping * v[2] ** 3]

    def gaps(self, q):
        return [q[1] - 0.5 - self.height * np.sin(2 * q[0]) * np.cos(q[2])]

    def restitutions(self):
        return [self.bounce]

    def nominal(self):
        return [0.1, 1.0, 0.2, 0.5, 0.0, 1.0], [0.2], 1.2


class DoublePendulum(cf.Formulas):
    """The model double_pendulum of C++: M depends on q, elastic stops, two torques."""

    name = "double_pendulum_in_python"
    coordinates = ("shoulder", "elbow")
    units = ("rad", "rad")
    constraints = ("shoulder_stop", "elbow_stop")
    inputs = ("shoulder_torque", "elbow_torque")
    parameters = {"m0": 1.0, "m1": 1.0, "l0": 0.5, "l1": 2 / 7, "restitution": 0.3}
    affine_constraints = True

    def inertias(self):
        rod0, rod1 = self.m0 * self.l0**2, self.m1 * self.l1**2
        d = rod1 / 3 + rod1 / 4
        return rod0 / 3 + rod0 / 4 + self.m1 * self.l0**2 + d, self.m1 * self.l0 * self.l1 / 2, d

    def mass_matrix(self, q):
        a, b, d = self.inertias()
        bc = b * np.cos(q[1])
        return [[a + 2 * bc, d + bc], [d + bc, d]]

    def force(self, q, v, u):
        return u

    def gaps(self, q):
        _, b, d = self.inertias()
        return [q[0], np.arccos(-d / b) - q[1]]


class Pendulum(cf.Formulas):
    """A point mass on a rod, by its angle, with an elastic wall below the hinge."""

    coordinates = ("angle",)
    units = ("rad",)
    circles = ("angle",)
    constraints = ("wall",)
    parameters = {"mass": 0.8, "length": 1.3, "gravity": 5.0, "restitution": 0.6}
    constant_mass = True

    def mass_matrix(self, q):
        return [[self.mass * self.length**2]]

    def force(self, q, v, u):
        return [-self.mass * self.gravity * self.length * np.sin(q[0])]

    def gaps(self, q):
        return [self.length * np.sin(q[0])]


class Rod(cf.Formulas):
    """The same in the plane, the rod as a closure."""

    coordinates = ("x", "z")
    constraints = ("wall",)
    bilateral = ("rod",)
    parameters = Pendulum.parameters
    constant_mass = True

    def mass_matrix(self, q):
        return [[self.mass, 0], [0, self.mass]]

    def force(self, q, v, u):
        return [0.0, -self.mass * self.gravity]

    def gaps(self, q):
        return [q[0]]

    def closures(self, q):
        return [np.hypot(q[0], q[1]) - self.length]

    def nominal(self):
        angle = 0.9
        x = self.length * np.array([np.sin(angle), -np.cos(angle)])
        return np.concatenate([x, [0.0, 0.0]]), [], 1.5
