// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "contact_flow/derivative/cluster_class.h"
#include "contact_flow/derivative/contact_rates.h"
#include "contact_flow/derivative/order_outcomes.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/impact_reset.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"

namespace contact_flow {

/// One event of a run that is perturbed to first order, near a transition.
struct PerturbedEvent {
  enum class Kind {
    kActivation,  ///< a touchdown, or a compliant constraint that changes sides
    kRelease,     ///< a force passes zero
    kClosing,     ///< a contact that let go at an impact of the cluster falls back and holds again
    kInput,       ///< the input changes; `constraint` is n + its number in the cluster
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

/// Pieces were asked for where the first-order map is none of linear pieces, or where pieces of
/// full dimension do not say all of it; the message names constraint, time and reason.
struct NotPiecewiseLinear : std::domain_error {
  using std::domain_error::domain_error;
};

/// First-order changes of the instants of the events of a piece.
struct PieceTimes {
  std::vector<int> constraints;  ///< of its events, in their order
  Matrix times;                  ///< a row for each [· × 2d+k]
};

/// The linear map that holds around the run perturbed along one direction: where orders of events
/// have different maps, that of its order. c changes of the input are among its events, which may
/// come later by δt.
struct EventPiece {
  Matrix matrix;             ///< Ξ [2d+k × 2d+k]
  Matrix by_instants;        ///< ∂B/∂δt [2d+k × c]
  std::vector<int> order;    ///< its events, as in EventMap; with friction those of TimesOfPieces
  Matrix times;              ///< first-order changes of their instants [· × 2d+k]
  Matrix times_by_instants;  ///< … by δt [· × c]
  /// v after each of them [d] and the input from there on [m].
  std::vector<Vector> velocities;
  std::vector<Vector> inputs;      ///< as velocities
  std::vector<ContactMode> modes;  ///< after them
};

class ClusterGeometry;
class FrictionalEvent;
struct FrictionalPath;

/// The first-order map of one transition (Theorem 1) in the tangent vector w at (ρ, v⁻): in general
/// piecewise linear, one selection for each order σ of the m simultaneous activations.
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
///
/// Contacts that rest may open inside the cluster: where their force would have to pull, and where
/// an impact whose impulse on them vanishes lifts them to first order (the derivative of its
/// complementarity problem is one itself). In w the gap is then of second order, the rate of the
/// first one,
///   r_j = D(Da_j v) w,   ṙ_j = ä_j in F_S,
/// so that a contact that is pushed again returns at a root of a quadratic polynomial, after a time
/// of first order, and is hit with a speed of first order. A direction follows all of that, and is
/// exact. Where the outcome depends on whether a contact had returned when another impact came, the
/// map is positively homogeneous but not piecewise linear: PiecewiseLinear() says so.
///
/// Changes of the input that coincide with the events are events, too: with guard h = t − t_k, no
/// reset, and the field of the next input from there on. Change number k of the cluster is event
/// n + k of an order, n being the number of constraints; they happen in this order. Their instants
/// do not move with w, but by δt_k where that is given.
///
/// Where friction takes part (FrictionTakesPart) all of it is answered by a FrictionalEvent, whose
/// pieces are not orders: then activated() is empty, and Selection, Cone and Times are those of one
/// piece. Where it does not, whatever else the system has, contacts with friction go on aside.
class EventMap {
 public:
  /// `dynamics` is scratch that the maps of a trajectory share; its system must outlive the map.
  EventMap(std::shared_ptr<ContactDynamics> dynamics, const Transition& transition);
  /// The same of a cluster in which the input changes, `later` having the inputs after each change.
  EventMap(std::shared_ptr<ContactDynamics> dynamics, const Transition& transition,
           std::vector<std::shared_ptr<ContactDynamics>> later);
  /// The identity, for a transition of the trajectory that belongs to the cluster before it.
  EventMap AbsorbedRest() const;

  /// kOk; kDiscontinuous when orders disagree (then `outcomes` lists them); kNotDifferentiable.
  const Status& status() const { return status_; }
  /// The outcome of every order, filled when the status is kDiscontinuous; those that were cut,
  /// when it is undecided for them.
  const std::vector<OrderOutcome>& outcomes() const { return cluster_.outcomes; }
  /// The class of the cluster, and what was neglected to give a derivative.
  const ClusterReport& cluster() const { return cluster_; }
  double time() const { return transition_.t; }
  /// The cluster that it is the map of; one of its own where changes of the input belong to it.
  const Transition& transition() const { return transition_; }
  /// Whether this is AbsorbedRest.
  bool absorbed() const { return absorbed_; }
  /// How many changes of the input are events of the cluster.
  int num_input_changes() const { return static_cast<int>(later_.size()); }
  /// Whether event i of an order is one.
  bool IsInputChange(int i) const { return i >= system_->num_constraints(); }
  /// I_a, the compliant constraints that change sides and the changes of the input, all at once; m
  /// of them.
  const std::vector<int>& activated() const { return activated_; }
  /// The constraints among them.
  ConstraintSet ActivatedConstraints() const;
  int num_activations() const { return static_cast<int>(activated_.size()); }

  /// B(w) [2d+k]. Throws std::domain_error, naming constraint and time, where a contact that opened
  /// never comes to rest again (γ = 1).
  Vector operator()(const VectorRef& w) const;
  /// The same where the changes of the input come later by `dt` [num_input_changes()], which must
  /// keep their order. Throws std::invalid_argument where it does not.
  Vector operator()(const VectorRef& w, const VectorRef& dt) const;
  /// What happens to the run perturbed along w, to first order and in this order. Bounces of first
  /// order speed are left out: an elastic contact closes where they have died away.
  std::vector<PerturbedEvent> PerturbedEvents(const VectorRef& w) const;
  /// The contact modes that the run perturbed along w passes through after J⁻, to first order; the
  /// last is J⁺. Activations and releases that coincide to first order make one transition.
  std::vector<ContactMode> PerturbedModes(const VectorRef& w) const;

  /// The piece that holds w, m + 1 fields and m resets as matrices. w = 0: any. Throws
  /// NotPiecewiseLinear where B is not linear on the cone of w's order, and like B(w).
  EventPiece PieceAlong(const VectorRef& w) const;
  /// Whether it is the only one whatever w, at once: false where that takes IsDifferentiable.
  bool HasOnePiece() const;

  /// kOk where B is linear on the cone of every order; kNotDifferentiable with the sentence why
  /// not; kTooManyPieces beyond 12 activations, which are not examined.
  const Status& PiecewiseLinear() const;
  /// The same along one order.
  Status PiecewiseLinear(const std::vector<int>& order) const;

  /// Ξ_σ [2d×2d] of the order σ: the product of saltation matrices. Throws NotPiecewiseLinear.
  Matrix Selection(const std::vector<int>& order) const;
  /// One of them, for estimates; the identity where B is not linear along it.
  Matrix AnySelection() const;
  /// Half-spaces {w : τ_σ(1) ≤ … ≤ τ_σ(m)} [h×2d], unit rows.
  Matrix Cone(const std::vector<int>& order) const;
  /// First-order change of the time of each activation along the order σ, a row each [m × 2d+k].
  Matrix Times(const std::vector<int>& order) const;
  /// The same of each of Pieces(max_activations); with friction touchdowns, ends of slip, and
  /// releases of what never slips.
  std::vector<PieceTimes> TimesOfPieces(int max_activations) const;
  /// Contact modes after J⁻ in the order σ, releases at the end.
  std::vector<ContactMode> Modes(const std::vector<int>& order) const;
  /// The whole map: m! pieces. Throws std::length_error when m > max_activations, and
  /// NotPiecewiseLinear.
  PiecewiseLinearMap Pieces(int max_activations) const;
  Modularity AssessModularity() const;
  /// True when the relative defect is known and not larger than `tolerance`: the outcome is C¹.
  bool IsDifferentiable(double tolerance) const {
    return AssessModularity().Relative() <= tolerance;
  }

  /// Evaluations of the field F_S and of resets so far, for the complexity tests.
  long field_evaluations() const { return static_cast<long>(stages_.size()); }
  long reset_evaluations() const { return static_cast<long>(passages_.size()); }

 private:
  friend class Germ;
  friend class OrderWalk;
  void Begin();
  /// The events that may come after those in S: changes of the input in their order.
  ConstraintSet Remaining(ConstraintSet S) const;
  /// Whether the changes of the input are in their order.
  bool IsOrder(const std::vector<int>& order) const;
  /// The dynamics under the input after the events in S.
  ContactDynamics& DynamicsAfter(ConstraintSet S) const;
  /// A tangent with the places −δt_k of the changes of the input behind it, in which h_k = t − t_k
  /// is counted; a matrix that leaves these alone.
  Vector Widen(const VectorRef& w, const VectorRef& dt) const;
  Matrix Widen(const Matrix& map) const;
  /// With friction: one of its paths.
  FrictionalPath AnyPath() const;
  /// Selection and Times with the places of δt.
  Matrix WideSelection(const std::vector<int>& order) const;
  Matrix WideTimes(const std::vector<int>& order) const;
  /// What order zero knows of the cluster after the activations in S.
  struct Instant {
    Vector v;               // v_S [d]
    ConstraintSet resting;  // rigid contacts without normal velocity that have not bounced
    ContactRates rates;     // r_j along w at v_S
  };
  /// The cluster after the activations in S while certain resting contacts are closed.
  struct Stage {
    Vector v;          // v_S [d]
    ContactMode mode;  // those of them that push, and the compliant ones that are pressed
    Vector field;      // in this mode [2d+k+c]
  };
  /// The activation of one constraint while certain resting contacts are closed.
  struct Passage {
    ImpactReset reset;     // DR_i, with all closed contacts held that have no impulse
    ConstraintSet struck;  // those with an impulse, i among them
    ConstraintSet held;    // closed afterwards
    /// Closed before, without impulse, and lifted or pressed to first order; or open before, with
    /// a rate that changes to first order.
    ConstraintSet disturbed;
    ImpactReset free;  // DR_i with the closed ones of these free, where there are any
  };
  /// Contacts at rest that the impact of i pushes or lifts, but less than counts as an impulse.
  ConstraintSet Brushed(const Instant& before, int i, const ImpactResult& impact) const;
  [[noreturn]] void RefuseBrushed(int i, int j) const;
  const Instant& InstantAt(ConstraintSet S) const { return instants_.at(S); }
  /// The stage after S while `closed`, a part of the resting contacts, are closed.
  const Stage& StageAt(ConstraintSet S, ConstraintSet closed) const;
  bool PushAll(ConstraintSet S, ConstraintSet closed, Stage* stage) const;
  /// The stage where all resting contacts are closed: every contact that opened has returned.
  const Stage& StageAt(ConstraintSet S) const { return StageAt(S, InstantAt(S).resting); }
  /// The activation of i after S while `closed` are closed. Makes the instant after it.
  const Passage& PassageAt(ConstraintSet S, ConstraintSet closed, int i) const;
  /// The stage reached from S by the activation of i, and the reset DR_i(ρ, v_S) on the way, where
  /// every contact that opened returns at once.
  const Stage& Activate(ConstraintSet S, int i, const ImpactReset** reset) const;
  /// `rates_q`: ∂(Da v)/∂q, where it is known.
  void AddInstant(ConstraintSet S, const Vector& v, const SparseRows* rates_q = nullptr) const;
  /// `terms` where resets are products, else null.
  void FindDisturbed(ConstraintSet S, ConstraintSet closed, int i, const ImpactResult& impact,
                     const std::shared_ptr<const ImpactReset::Terms>& terms,
                     Passage* passage) const;
  ImpactReset Reset(ConstraintSet S, int i, const ImpactResult& impact,
                    const std::shared_ptr<const ImpactReset::Terms>& terms,
                    ConstraintSet persisting) const;
  /// Whether no contact of `quiet` has another rate along two mixtures of all tangents.
  bool NoneDisturbed(ConstraintSet S, ConstraintSet quiet, int i, const ImpactReset& free) const;
  /// Members of `candidates` without normal velocity at v, but for those in `elastic`.
  ConstraintSet Resting(const Vector& v, ConstraintSet candidates, ConstraintSet elastic) const;
  /// First-order time to the activation of i, in stage v_S.
  double TimeTo(int i, const Stage& stage, const Vector& w) const;
  /// The same for the columns of W.
  Eigen::RowVectorXd TimesTo(int i, const Stage& stage, const Matrix& W) const;
  int size() const { return static_cast<int>(guards_.cols()); }
  /// Of the tangents that are given, 2d+k.
  int width() const { return size() - num_input_changes(); }
  /// Contacts that are no part of the impacts: the compliant ones, and those with friction, which
  /// keep their letters.
  ConstraintSet Aside() const;
  /// Those of them that press after the events in S.
  ContactMode ModeAside(ConstraintSet events) const;
  Transition WithoutAside() const;
  Vector State(const Vector& v) const;
  void MeasureRest(const Vector& v);
  void AddGuards(const Vector& v_minus);
  void Classify();
  void AddReleases();

  std::shared_ptr<ContactDynamics> dynamics_;
  std::vector<std::shared_ptr<ContactDynamics>> later_;  // after each change of the input
  const MechanicalSystem* system_;
  std::shared_ptr<const FrictionalEvent> friction_;  // null where friction takes no part
  Transition transition_;
  ConstraintSet events_;  // I_a, switches, and a release with a jump of the field
  Vector q_;
  std::vector<int> activated_;  // the members of events_
  // The guards' gradients [n+c × 2d+k+c]: Da_i and ∂a_i/∂p, or Dλ_i, and those of the c changes of
  // the input.
  Matrix guards_;
  SparseRows sparse_guards_;
  Matrix bilateral_;  // gradients of b [l × 2d+k+c]
  bool absorbed_ = false;
  bool decoupled_ = true;  // class A: every cone is m−1 half-spaces
  Status status_;
  ClusterReport cluster_;
  double rest_ = 0;                            // |Da_j v| / √G_jj up to which a contact rests
  double known_ = 0;                           // … and up to which it is not known to move
  std::shared_ptr<ClusterGeometry> geometry_;  // null with friction, or without events
  mutable std::map<ConstraintSet, Instant> instants_;
  mutable std::map<std::pair<ConstraintSet, ConstraintSet>, Stage> stages_;
  mutable std::map<std::tuple<ConstraintSet, ConstraintSet, int>, Passage> passages_;
  mutable std::map<std::pair<ConstraintSet, int>, ImpactReset> regained_;
  mutable bool examined_ = false;
  mutable Status piecewise_linear_;
};

}  // namespace contact_flow
