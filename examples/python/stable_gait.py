#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
#
# A trot that lands on both feet at once, from parameters that are 10 % off: the orbit by Newton's
# method on its kinked return map, and the proof that it is stable.
#
# Prints: stable: every piece contracts in the quadratic norm

import contact_flow as cf

trot = cf.Model("hopping_trot", push=2.8, leg_length=0.679)
orbit = trot.poincare(cf.Apex("body_z")).fixed_point(
    free=["axial_stiffness", "axial_damping", "push", "leg_length"],
    conditions=[{"kind": "period", "value": 0.8},
                {"kind": "coordinate", "name": "body_z", "value": 0.8},
                {"kind": "touchdown", "name": "left_foot", "value": 0.1},
                {"kind": "touchdown", "name": "left_foot", "other": "right_foot"},
                {"kind": "lift_off", "name": "left_foot", "value": 0.7},
                {"kind": "lift_off", "name": "left_foot", "other": "right_foot"}])
print(orbit.message)
print({name: round(orbit.parameters[name], 6) for name in ("axial_stiffness", "push", "leg_length")})
stability = orbit.stability(["body_x", "left_foot_x", "right_foot_x"])
print(stability.message)
print("certificate verified:", stability.verify())
