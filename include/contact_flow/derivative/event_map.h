// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "contact_flow/derivative/piecewise_linear_map.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// What one order of the simultaneous activations leads to, in the limit.
struct OrderOutcome {
  std::vector<int> order;   ///< constraints in the order in which they are hit
  Vector v_plus;            ///< velocity after the last impact [d]
  ContactMode mode_after;   ///< contact mode then
  Vector impulse;           ///< summed impulses [n] [N·s]
};

/// The first-order map of one transition (Theorem 1): piecewise linear in the tangent vector w at
/// (ρ, v⁻), one selection for each order σ of the m simultaneous activations.
///
///   S = ∅;  repeat: τ_i = −Da_i w_q / (Da_i v_S),  i* = argmin τ_i,
///           w ← DR_{i*}(ρ, v_S) (w + F_S τ_{i*}),  S ← S ∪ {i*};   finally w ← w − F_S Σ τ.
///
/// Deactivations contribute the identity. A direction costs m+1 field evaluations and O(m² d) besides.
class EventMap {
 public:
  EventMap(const MechanicalSystem& system, const Transition& transition, const VectorRef& u);

  /// kOk; kDiscontinuous when orders disagree (then `outcomes` lists them); kNotDifferentiable.
  const Status& status() const { return status_; }
  /// The outcome of every order, filled when the status is kDiscontinuous.
  const std::vector<OrderOutcome>& outcomes() const { return outcomes_; }
  /// m = |I_a|.
  int num_activations() const { return static_cast<int>(activated_.size()); }
  /// Constraints that are activated at once.
  const std::vector<int>& activated() const { return activated_; }

  /// B(w) [2d]; the order of activations met on the way is appended to `order` if given.
  Vector operator()(const VectorRef& w, std::vector<int>* order = nullptr) const;
  /// Ξ_σ [2d×2d] of the order σ: the product of saltation matrices.
  Matrix Selection(const std::vector<int>& order) const;
  /// Half-spaces {w : τ_σ(1) ≤ … ≤ τ_σ(m)} [h×2d], unit rows.
  Matrix Cone(const std::vector<int>& order) const;
  /// Modes passed through in the order σ: J⁻ ∪ K_S for every stage after the first, m of them.
  std::vector<ContactMode> Modes(const std::vector<int>& order) const;
  /// The whole map, m! pieces. Throws std::length_error when m > max_activations.
  PiecewiseLinearMap Pieces(int max_activations) const;
  /// True when S ↦ F̂_S is modular: all selections are equal (C¹). Costs 2^m vectors, m ≤ 12 or false.
  bool IsDifferentiable(double tolerance) const;

  /// Number of evaluations of the field F_S so far, for the complexity tests.
  long field_evaluations() const { return field_evaluations_; }

 private:
  /// The state of the cluster after the activations in S.
  struct Stage {
    Vector v;          ///< v_S [d]
    ContactMode mode;  ///< K_S
    Vector field;      ///< F_S = (v_S, q̈_S) [2d]
  };
  const Stage& StageOf(ContactMode activated) const;
  const Matrix& ResetOf(ContactMode activated, int next) const;
  void Classify();

  const MechanicalSystem* system_;
  Vector u_;
  Vector q_;
  Vector v_minus_;
  ContactMode mode_before_;
  ContactMode mode_after_;
  std::vector<int> activated_;
  Matrix constraint_jacobian_;  // Da(ρ) [n×d]
  bool decoupled_ = true;       // class A
  Status status_;
  std::vector<OrderOutcome> outcomes_;
  mutable std::map<ContactMode, Stage> stages_;
  mutable std::map<std::pair<ContactMode, int>, Matrix> resets_;
  mutable long field_evaluations_ = 0;
};

}  // namespace contact_flow
