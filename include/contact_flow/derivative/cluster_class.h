// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/constraint_set.h"
#include "contact_flow/derivative/order_outcomes.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What decides the outcome of contacts that meet at once (Sec. 2 and Assumption 4 of the paper).
/// G = Da M⁻¹ Daᵀ over all that touch, those that rest too.
enum class ContactClass {
  kSingle = 0,          ///< at most one constraint, or one impact: nothing to decide
  kOrthogonal = 1,      ///< Assumption 4, G_ij = 0: continuous and piecewise differentiable, any γ
  kAttracting = 2,      ///< γ = 0 and G_ij ≤ 0: the same, although Assumption 4 fails
  kOrderDependent = 3,  ///< the order of impacts decides the outcome: discontinuous
  kDependent = 4,       ///< Assumption 3 fails: the constraints are linearly dependent
  kOrdersAgree = 5,     ///< none of these, but every order leads where the simultaneous impact does
  kUndecided = 6,       ///< none of these, and not all orders can be followed to their end
};

/// "orthogonal", …
const char* ContactClassName(ContactClass contact_class);

/// At most this many events are followed in every order: activations, and forces that vanish.
inline constexpr int kMaxClassifiedEvents = 5;

/// The class of a cluster of simultaneous events, under the law of its transition.
///
/// Contacts fall into groups that G couples. A group is harmless when it is one contact, or when γ
/// = 0 and G_ij ≤ 0 for all its pairs: G is then an M-matrix, no impact releases a contact, and all
/// orders end at the same projection, whether contacts that rest take part at once or later. Where
/// a group is not harmless and more than one event meets, every order is followed by single impacts
/// and compared with the simultaneous one in v⁺, in what rests, and in the mode.
///
/// A pair counts as orthogonal when what its coupling changes is smaller than what an error δx of
/// the located state changes, κ = 1e3 times the tolerances (absolute + relative |x|), both in the
/// outcome and in the derivative:
///   |Δv⁺| ≤ δv + |∂v⁺/∂q| δq + Σ_i |P Da_iᵀ| (1+γ_i) |Da_i| δv / G_ii,  coordinate by coordinate,
///   |Δ∂v⁺/∂v⁻| ≤ κ rtol max(1, max|∂v⁺/∂v⁻|),
/// entries in units of coordinates in which M has a diagonal of ones. By q and by parameters the
/// limit is κ rtol times what the impact itself gives to such entries.
/// What is neglected so is reported.
struct ClusterReport {
  ContactClass contact_class = ContactClass::kSingle;
  /// kOk; kDiscontinuous; kNotDifferentiable where the outcome is continuous as far as is known,
  /// but the selections are not the products of resets. The message names constraints and reason.
  Status status;
  /// Of every order, where the class is kOrderDependent; cut ones, where it is kUndecided.
  std::vector<OrderOutcome> outcomes;
  /// v_S and what rests then are the same for every order of the impacts in S.
  bool staged = true;
  bool decoupled = true;  ///< all pairs count as orthogonal
  /// Largest difference in v⁺ between orders that was neglected, a bound [d].
  Vector neglected_jump;
  /// Largest entry of the derivative of the outcome of the cluster that was neglected, a bound:
  /// couplings, and their slopes where both touch.
  double neglected_derivative = 0;
};

class ClusterGeometry;

/// `dynamics` has the input and the variables, `geometry` may be known. Throws nothing for impacts
/// that cannot be solved: these are kDependent.
ClusterReport ClassifyCluster(ContactDynamics* dynamics, const Transition& transition,
                              ClusterGeometry* geometry = nullptr);

/// The class that the couplings at q alone give to contacts that would all be hit at once:
/// kSingle, kOrthogonal, kAttracting or kOrderDependent. A coupling counts as zero when it changes
/// no entry of Δ by more than 1e-6 of the largest (at least 1).
ContactClass ClassifyCouplings(const MechanicalSystem& system, const VectorRef& q,
                               ConstraintSet touching);

}  // namespace contact_flow
