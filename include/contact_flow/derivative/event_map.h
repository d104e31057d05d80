// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/derivative/cluster_class.h"
#include "contact_flow/derivative/order_outcomes.h"
#include "contact_flow/derivative/piecewise_linear_map.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// One event of a run that is perturbed to first order, near a transition.
struct PerturbedEvent {
  enum class Kind {
    kActivation,  ///< a touchdown, or a compliant constraint that changes sides
    kRelease,     ///< a force passes zero
    kClosing,     ///< a contact that let go at an impact of the cluster falls back and holds again
  };
  Kind kind = Kind::kActivation;
  int constraint = 0;
  double time = 0;   ///< after the unperturbed transition, to first order [s]
  ContactMode mode;  ///< after it
};

/// How far the fields of a cluster are from S ↦ F̂_S being modular, F̂_S being F_S carried through
/// the resets of the activations that are left. The selections of two neighbouring orders differ by
/// defect vector × (τ_i − τ_j).
struct Modularity {
  /// The largest entry of |F̂_{S+ij} − F̂_{S+i} − F̂_{S+j} + F̂_S| over S, i, j, in [m/s] or [m/s²]:
  /// how much the outcome bends per second between two touchdowns. 0: all selections are equal, the
  /// outcome is C¹. NaN where it is not known: there is no derivative, or more than 12 activations
  /// (2^m vectors).
  double defect = 0;
  double scale = 1;  ///< largest entry of the F̂_S, but at least 1
  double Relative() const { return defect / scale; }
};

/// The first-order map of one transition (Theorem 1): piecewise linear in the tangent vector w at
/// (ρ, v⁻), one selection for each order σ of the m simultaneous activations.
///
///   S = ∅;  repeat m times:  τ_i = −(Da_i w_q + ∂a_i/∂p δp) / (Da_i v_S),  i* = argmin τ_i,
///           w ← DR_{i*}(ρ, v_S) (w + F_S τ_{i*}),  S ← S ∪ {i*};      finally  w ← w − F_S Σ τ.
///
/// v_S, K_S and F_S are velocity, contact mode and field after the activations in S. A deactivation
/// contributes the identity: F is continuous where λ_i = 0. A compliant constraint that changes
/// sides counts as an activation without reset; a force that vanishes where the effort depends on
/// the mode is a crossing of the surface λ_i = 0 between two fields, and must be alone. w = (δq,
/// δv, δu, δp) throughout. One direction costs m+1 evaluations of the field, m resets and O(m² d)
/// besides; stages are kept, so that further directions cost O(m² d).
class EventMap {
 public:
  /// `dynamics` is scratch, shared between the maps of one trajectory; its system must outlive the
  /// map.
  EventMap(std::shared_ptr<ContactDynamics> dynamics, const Transition& transition);

  /// kOk; kDiscontinuous when orders disagree (then `outcomes` lists them); kNotDifferentiable.
  const Status& status() const { return status_; }
  /// The outcome of every order, filled when the status is kDiscontinuous; those that were cut, when
  /// it is undecided for them.
  const std::vector<OrderOutcome>& outcomes() const { return cluster_.outcomes; }
  /// The class of the cluster, and what was neglected to give a derivative.
  const ClusterReport& cluster() const { return cluster_; }
  double time() const { return transition_.t; }
  /// I_a and the compliant constraints that change sides, all at once; m of them.
  const std::vector<int>& activated() const { return activated_; }
  int num_activations() const { return static_cast<int>(activated_.size()); }

  /// B(w) [2d].
  Vector operator()(const VectorRef& w) const;
  /// What happens to the run perturbed along w, to first order and in this order. Between the
  /// impacts of a cluster a contact may let go and be closed again later: its gap is of second
  /// order in w, the times are of first.
  std::vector<PerturbedEvent> PerturbedEvents(const VectorRef& w) const;
  /// The contact modes that the run perturbed along w passes through after J⁻, to first order; the
  /// last is J⁺. Activations and releases that coincide to first order make one transition.
  std::vector<ContactMode> PerturbedModes(const VectorRef& w) const;

  /// Ξ_σ [2d×2d] of the order σ: the product of saltation matrices.
  Matrix Selection(const std::vector<int>& order) const;
  /// Half-spaces {w : τ_σ(1) ≤ … ≤ τ_σ(m)} [h×2d], unit rows.
  Matrix Cone(const std::vector<int>& order) const;
  /// First-order change of the time of each activation along the order σ, a row each [m × 2d+k].
  Matrix Times(const std::vector<int>& order) const;
  /// Contact modes after J⁻ in the order σ, releases at the end.
  std::vector<ContactMode> Modes(const std::vector<int>& order) const;
  /// The whole map: m! pieces. Throws std::length_error when m > max_activations.
  PiecewiseLinearMap Pieces(int max_activations) const;
  Modularity AssessModularity() const;
  /// True when the relative defect is known and not larger than `tolerance`: the outcome is C¹.
  bool IsDifferentiable(double tolerance) const {
    return AssessModularity().Relative() <= tolerance;
  }

  /// Evaluations of the field F_S and of resets so far, for the complexity tests.
  long field_evaluations() const { return static_cast<long>(stages_.size()); }
  long reset_evaluations() const { return static_cast<long>(resets_.size()); }

 private:
  /// The cluster after the activations in S.
  struct Stage {
    Vector v;          // v_S [d]
    ContactMode mode;  // K_S
    Vector field;      // F_S [2d+k]
  };
  const Stage& StageAt(ContactMode activated) const { return stages_.at(activated); }
  /// The stage reached from S by the activation of i, and the reset DR_i(ρ, v_S) on the way.
  const Stage& Activate(ContactMode activated, int i, const Matrix** reset) const;
  /// Members of `candidates` without normal velocity at v, but for those in `elastic`.
  ContactMode Resting(const Vector& v, ContactMode candidates, ContactMode elastic) const;
  /// Normal acceleration of the constraint i at v_S, in the given mode [m/s²].
  double GapAcceleration(int i, const Vector& v, const Vector& field) const;
  /// First-order time to the activation of i, in stage v_S.
  double TimeTo(int i, const Stage& stage, const Vector& w) const;
  /// The same as a row [1 × 2d+k].
  Eigen::RowVectorXd TimeRow(int i, const Stage& stage) const;
  int size() const { return static_cast<int>(guards_.cols()); }
  /// The compliant constraints that are pressed after the events in S.
  ContactMode Pressed(ContactMode events) const;
  Vector State(const Vector& v) const;
  void Classify();
  void AddReleases();

  std::shared_ptr<ContactDynamics> dynamics_;
  const MechanicalSystem* system_;
  Transition transition_;
  ContactMode events_;  // I_a, switches, and a release with a jump of the field
  Vector q_;
  std::vector<int> activated_;  // the members of events_
  Matrix jacobian_;             // Da(ρ) [n×d]
  Matrix guards_;               // the guards' gradients [n × 2d+k]: Da_i and ∂a_i/∂p, or Dλ_i
  bool decoupled_ = true;       // class A: every cone is m−1 half-spaces
  Status status_;
  ClusterReport cluster_;
  mutable std::map<ContactMode, Stage> stages_;
  mutable std::map<std::pair<ContactMode, int>, Matrix> resets_;
};

}  // namespace contact_flow
