// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The inertia, M_jj, of a velocity that is driven: no force and no impulse changes it, as none
/// changes the rate of a clock. What a constraint a(q, t) of time pushes is the clock, too, whose
/// column of Da is ∂a/∂t; with this inertia it is changed by 1e-36 of that, which is nothing beside
/// its rate of 1. M must have no other entries in row and column j.
inline constexpr double kDrivenInertia = 0x1p120;

/// The velocities that are driven, ascending.
std::vector<int> Driven(const MatrixRef& mass);
/// v [d] with zeros there: their kinetic energy measures nothing.
Vector Moved(const MatrixRef& mass, const VectorRef& v);
/// Compliant constraints of a clock alone, as the knots of a linear reference: each of a coordinate
/// whose velocity is not 0, and which no force and no constraint changes, as far as (q, v) tells.
/// When they come nothing else decides.
ConstraintSet DrivenSwitches(const MechanicalSystem& system, const VectorRef& q,
                             const VectorRef& v);
/// √(vᵀ M v) of what is moved: a speed in the kinetic metric.
double KineticSpeed(const MatrixRef& mass, const VectorRef& v);
/// ½ vᵀ M v of what is moved [J].
double KineticEnergy(const MatrixRef& mass, const VectorRef& v);

}  // namespace contact_flow
