#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
#
# Both feet of a biped land at once: the final state has one-sided derivatives, one to each side.
#
# Prints: pitch up: 0.9434 rad, pitch down: 0.8055 rad

import contact_flow as cf

biped = cf.Model("soft_biped", stiffness=27)
run = biped.simulate()
for event in run.events:
    print("t = %.6f s: %s -> %s" % (event.t, event.mode_before, event.mode_after))
B = run.derivative()
print("a radian of pitch at the start becomes, to first order, at %g s:" % run.t_end)
pitch = biped.velocities.index("body_pitch")
print("pitch up: %.4f rad, pitch down: %.4f rad"
      % (B("+body_pitch")[pitch], -B("-body_pitch")[pitch]))
print("continuously differentiable: %s; pieces: %d" % (B.is_differentiable, len(B.pieces())))
