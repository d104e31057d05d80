// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "test/adversary/rescaled_system.h"

namespace contact_flow {
namespace adversary {

// What has to hold whatever the system is, without a reference. Each answers with the law that is
// broken and by how much, or with nothing.

/// No impact adds energy: ½ v⁺ᵀMv⁺ ≤ ½ v⁻ᵀMv⁻. With different restitutions in one cluster it may.
std::string BrokenEnergyLaw(const MechanicalSystem& system, const Trajectory& run);

/// B is positively homogeneous: B(λw) = λ B(w) at a `w` of length 1 that the start admits. Sizes
/// are judged after `units` are taken back.
std::string BrokenHomogeneity(const BDerivative& B, const Vector& w, const Units& units);

/// A start that is moved along its own flow moves the end along its: B(F(x₀)) = F(φ(T, x₀)), in a
/// run of one input. Sizes as above. `loose`: what a run at tolerance 1e-9 may miss, so many times.
std::string BrokenFlowLaw(const MechanicalSystem& system, const Trajectory& run,
                          const BDerivative& B, const Units& units, double loose);

}  // namespace adversary
}  // namespace contact_flow
