// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/constraint_set.h"
#include "contact_flow/derivative/cluster_class.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Coupling of two constraints in the kinetic metric, G_ij/√(G_ii G_jj) ∈ [−1, 1].
struct Coupling {
  int first = 0;     ///< a constraint
  int second = 0;    ///< another one
  double value = 0;  ///< G_ij / √(G_ii G_jj)
};

/// The assumptions of the paper at one state, for the constraints that touch there.
struct AssumptionReport {
  ConstraintSet touching;  ///< constraints that touch
  /// Assumption 2 at the state: M is positive definite; M, f, a and their first derivatives are
  /// finite there.
  bool smooth = false;
  double mass_condition = 0;  ///< condition number of M
  /// Assumption 3: rank of Da M⁻¹ Daᵀ over the touching constraints, and its condition number once
  /// its diagonal is scaled to 1 (+∞ when dependent, 1 when orthogonal or empty).
  int rank = 0;
  double condition = 1;  ///< of their gradients, in the kinetic metric
  /// Constraint qualification (Mangasarian–Fromovitz): some velocity opens all touching gaps.
  bool qualified = true;
  std::vector<Coupling> couplings;                     ///< every pair, i < j
  ContactClass contact_class = ContactClass::kSingle;  ///< the worst of the pairs

  /// Whether the gradients of all that touch are independent.
  bool independent() const { return rank == touching.Size(); }
  /// The largest |coupling|, 0 without pairs.
  double LargestCoupling() const;
};

/// Reports on the state x with input u, taking `touching` as the constraints in contact.
AssumptionReport AssessAssumptions(const MechanicalSystem& system, const VectorRef& x,
                                   const VectorRef& u, ConstraintSet touching);

/// The report of each transition of a run, at (ρ, v⁻), for I_a ∪ J⁻. Where several of them are hit
/// at once the class is that of the cluster, as EventMap has it (ClassifyCluster).
std::vector<AssumptionReport> AssessTransitions(const MechanicalSystem& system,
                                                const Trajectory& trajectory);

/// One pair of constraints over a region of configurations.
struct PairInRegion {
  int first = 0;        ///< a constraint
  int second = 0;       ///< another one
  int met = 0;          ///< sampled configurations where both touch and no gap is negative
  double smallest = 0;  ///< coupling over these
  double largest = 0;   ///< coupling over these
  ContactClass worst = ContactClass::kSingle;  ///< class over these
};

/// The assumptions over a box around a state.
struct RegionReport {
  int samples = 0;                    ///< number of states
  int smooth = 0;                     ///< samples where Assumption 2 holds
  double largest_mass_condition = 0;  ///< of M
  std::vector<PairInRegion>
      pairs;  ///< every pair, i < j; met = 0: the two never touch together here
};

/// Samples `samples` states in x ± half_width [2d]. For each pair of constraints the configurations
/// are moved onto a_i = a_j = 0 by Newton's method in the kinetic metric. Deterministic: the same
/// `seed` gives the same report.
RegionReport AssessRegion(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u,
                          const VectorRef& half_width, int samples, unsigned seed = 1);

}  // namespace contact_flow
