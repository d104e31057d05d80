// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/analysis/poincare.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/piecewise_linear/section.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The derivative of a return map with inputs that are held from one return to the next, of all
/// that is not set aside: (z, δu) ↦ z⁺ [n × n+m], z = basisᵀ δx, as FindStabilizingFeedback takes
/// it. `neutral` [2d×k] are directions as of SetAside, `inputs` the indices of those that are
/// set. Throws std::invalid_argument for a return whose derivative is not by all inputs and nothing
/// else, for a contact mode at the return that is another than at the start, and for neutral
/// directions that are no tangents of the section.
ReducedMap ControlledReturn(const MechanicalSystem& system, const PoincareReturn& orbit,
                            const MatrixRef& neutral, const std::vector<int>& inputs);

/// A feedback once a step around an orbit: at each return the inputs are set, and held to the next.
struct StepFeedback {
  Vector x;                 ///< the fixed point [nq+d]
  Vector u;                 ///< the inputs of the orbit [m]
  Matrix basis;             ///< of what is fed back, orthonormal [2d×n]
  std::vector<int> inputs;  ///< indices of those that are set
  PiecewiseLinearMap law;   ///< κ [inputs×n]

  /// z = basisᵀ (state ⊟ x): how far a state at the section is from the orbit.
  Vector Deviation(const MechanicalSystem& system, const VectorRef& state) const;
  /// u + κ(z).
  Vector Input(const MechanicalSystem& system, const VectorRef& state) const;
};

/// Returns under a feedback, one after the other.
struct FollowedOrbit {
  std::vector<Vector> x;                          ///< at the section, the start first [nq+d]
  std::vector<Vector> u;                          ///< from one to the next
  std::vector<double> away;                       ///< |z| of each x
  ReturnStatus status = ReturnStatus::kReturned;  ///< of the last return
  std::string message;                            ///< why there is no further one
};

/// Simulates `count` returns from a state at the section, fewer where one fails or where |z| is
/// more than `lost`.
FollowedOrbit Follow(const MechanicalSystem& system, const Section& section,
                     const StepFeedback& feedback, const VectorRef& state, int count,
                     const PoincareOptions& options = {}, double lost = 1e3);

}  // namespace contact_flow
