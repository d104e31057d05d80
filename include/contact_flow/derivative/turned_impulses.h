// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What slips that turn while bounces are made rest (Transition::turned) leave unknown of a reset:
/// of a jump Δv [d], their share of its impulses is σ = shares Δv, two entries a slip. Of as large
/// ones across them the velocity is off by `across` σ′, |σ′_i| = |σ_i|.
struct TurnedImpulses {
  Matrix shares;  ///< [2s×d]
  Matrix across;  ///< [d×2s]; what came to rest stays there

  /// |σ_i| twice for each slip [2s].
  Vector SizesOf(const VectorRef& jump) const {
    Vector sizes = shares * jump;
    for (Eigen::Index k = 0; k + 1 < sizes.size(); k += 2) {
      sizes.segment<2>(k).setConstant(sizes.segment<2>(k).norm());
    }
    return sizes;
  }
};

/// Empty where no slip turns.
TurnedImpulses FindTurnedImpulses(const MechanicalSystem& system, const Transition& transition);

}  // namespace contact_flow
