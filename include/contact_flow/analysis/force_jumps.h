// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/constraint_set.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What becomes of a resting contact while a cluster of simultaneous impacts, perturbed, comes
/// apart into its stages S ⊂ I_a. Its force λ_i(S) is that at (ρ, v_S) in the contact mode K_S ∪
/// {i}: negative where the contact lets go.
enum class ForceFate {
  kKeeps = 0,     ///< λ_i(S) > 0 at every stage: its force jumps, its contact stays
  kReleased = 1,  ///< λ_i(S) < 0 from some stage on, whatever the order: it leaves for good
  /// λ_i(S) < 0 < λ_i(S') for some S ⊂ S': it lets go at S, falls back and is regained at S'. The
  /// first-order value stands; the selection of such an order is not C¹ but only Lipschitz.
  kRegained = 2,
  /// λ_i(S) ≈ 0 at some stage: whether it holds there is decided beyond first order. The
  /// first-order value stands (F is continuous where λ_i = 0), the C¹ hypothesis of the selection
  /// does not.
  kNearZero = 3,
};

/// "keeps", …
const char* ForceFateName(ForceFate fate);

/// The force of one contact at one stage.
struct StageForce {
  ConstraintSet activated;  ///< S: the impacts that have happened
  double force = 0;         ///< λ_i(S) [N]
  double rate = 0;          ///< dλ_i/dt there [N/s]
};

/// The forces of one contact that rests, at every stage at which it does, S in increasing size.
struct ForceJump {
  int constraint = 0;
  std::vector<StageForce> stages;
  ForceFate fate = ForceFate::kKeeps;
};

/// The forces in a cluster.
struct ForceJumpReport {
  /// False where the stages are not computed: more than kMaxStagedActivations; impacts whose order
  /// decides v_S (then there is no derivative anyway); a compliant constraint that changes sides at
  /// the same instant, or efforts that depend on the contact mode.
  bool computed = false;
  std::vector<ForceJump> contacts;

  /// The C¹ hypothesis of every selection holds: each contact keeps or is released.
  bool smooth() const;
};

/// At most this many simultaneous activations are taken apart into their 2^m stages.
inline constexpr int kMaxStagedActivations = 8;

/// Reports on one transition, run with input u, for the contacts of J⁻ and for plastic members of
/// I_a once they are hit. |λ_i(S)| counts as zero below `tolerance` times the largest force in the
/// report. A force that passes zero as an event of its own (Transition::vanishing) and does so with
/// a falling rate at S, too, is no borderline there: it lets go.
ForceJumpReport AssessForceJumps(const MechanicalSystem& system, const VectorRef& u,
                                 const Transition& transition, double tolerance = 1e-6);

}  // namespace contact_flow
