// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The directions that an initial state admits where it touches constraints i outside its contact
/// mode, a_i = 0 and i ∉ J: a cluster at the start, which the run leaves.
///   Da_i w_q < 0                       leads out of the domain,
///   Da_i w_q = 0, r_i = D(Da_i v) w < 0,
///     Da_i v = 0 and ä_i > 0           is an impact at the start with a speed of first order,
///   otherwise                          nothing happens.
/// An impact is shared by the contacts of J and by those that stay at zero with r ≤ 0, by the law
/// of the run: 0 ≤ p ⟂ r⁺ + γ r⁻ ≥ 0, or r⁺ = −γ r⁻. Another follows where it turns others back.
///
/// A contact of J in the plane that begins to slip there, to the side σ from s = T v = 0, slips to
/// the other side first where σ Ds w < 0, and is reversed after the time −Ds w / (Ds F₋) of first
/// order, F₋ being the field of that slip (friction, Sec. 4.3):
///   w ← w + (F₊ − F₋) Ds w / (Ds F₋).
/// That is followed for one such contact, where others neither stick nor change meanwhile.
///
/// A run that begins on a switch of time alone (DrivenSwitches, the knot of a reference) is on one
/// side of it. Starts on the other side have the other field until the run's is theirs:
///   w ← w + (F₊ − F₋) Da w / |ȧ|,
/// F₋ being the field before the switch. Where other contacts are touched besides, these directions
/// leave the domain, as do those by which a run no longer ends on its side of a switch.
class StartCone {
 public:
  /// Of a state that touches nothing else.
  StartCone() = default;
  /// `gap_tolerance` [m], `speed_tolerance` [m/s] and `impact_law` are those of the run, as in
  /// SimulateOptions.
  StartCone(ContactDynamics* dynamics, const VectorRef& x, ContactMode mode, double t,
            double gap_tolerance, double speed_tolerance, ImpactLaw impact_law);

  /// kNotDifferentiable where a constraint that is touched neither leaves nor belongs to the mode;
  /// kNotPiecewiseLinear where a contact begins to slip in space.
  const Status& status() const { return status_; }
  /// kOk where the map on the admitted directions is continuous.
  const Status& PiecewiseLinear() const { return piecewise_linear_; }
  bool Empty() const { return contacts_.empty(); }
  /// The run ends on a switch of time alone: admits the directions w with side·w ≥ 0 [2d+k].
  void EndOnSwitch(int constraint, const VectorRef& side);

  /// The constraint through which w [2d+k] leaves the domain; −1: none.
  int Leaves(const VectorRef& w) const;
  /// Whether it is a contact of the mode that begins to slip: what Leaves then says is that w would
  /// reverse that slip.
  bool Reverses(int constraint) const;
  /// Whether it is a switch of time alone: what Leaves then says is that w moves the clock over it,
  /// at the begin or the end of the run.
  bool IsSwitch(int constraint) const;
  /// w after what happens at the start. Throws std::invalid_argument, naming the constraint, for a
  /// direction that leaves the domain, and std::domain_error where the impact would lift a contact
  /// of the mode.
  Vector operator()(const VectorRef& w) const;
  /// The contacts outside the mode, which leave from rest, whose gaps stay 0 along w.
  ConstraintSet Brushed(const VectorRef& w) const;
  /// Half-spaces {w : Da_i w_q ≥ 0} [· × 2d+k], unit rows.
  Matrix Cone() const;
  /// Where a slip begins: the matrix of the directions that reverse it, else empty [2d+k × 2d+k],
  /// and σ Ds, which is negative on these.
  struct Reversal {
    Matrix matrix;
    Vector side;
  };
  Reversal reversal() const;

  /// Of a slip that begins with a speed below the tolerance, which the above takes for none: the α
  /// at which x + α w has none. Closer to x the slip of the start decides whether it is reversed,
  /// and w becomes Unturned(w). 0: both are the same.
  double InnerRadius(const VectorRef& w) const;
  Vector Unturned(const VectorRef& w) const;

  /// A bound on the run from x + α w, α > 0.
  struct Bound {
    int constraint = -1;
    double alpha = 0;
  };
  /// 0 for a direction that leaves the domain; where a contact that begins to open would be hit;
  /// constraint −1 without a bound.
  Bound Limit(const VectorRef& w) const;

 private:
  struct Contact {
    int constraint = 0;
    bool slips = false;       // it is in the mode and begins to slip; its gap stands for σ T v
    double slip = 0;          // σ T v, which counts as none [m/s]
    double speed = 0;         // Da_i v, 0 at rest, ∞ of switches of time [m/s]
    double acceleration = 0;  // ä_i, of those at rest [m/s²]
    Vector gap;               // Da_i and ∂a_i/∂p [2d+k]
    Vector rate;              // D(Da_i v) [2d+k]
    Vector turn;  // (F₊ − F₋)/(σ Ds F₋), or empty where it is not followed [2d+k]
    bool at_rest() const { return speed == 0; }
  };
  static Contact SwitchOf(int constraint, const VectorRef& side);
  bool Closes(const Contact& contact, const VectorRef& w) const;
  void FollowReversal(ContactDynamics* dynamics, const VectorRef& x, ContactMode mode,
                      Contact* contact) const;
  bool Stays(const Contact& contact, const VectorRef& w) const;
  /// The rows of what an impact along w is shared by; empty where nothing is hit.
  std::vector<int> Hit(const VectorRef& w) const;
  /// The change of w_v by their impulses [d].
  Vector Impact(const std::vector<int>& rows, const VectorRef& w) const;
  [[noreturn]] void Refuse(const std::string& what) const;

  std::vector<Contact> contacts_;
  std::vector<std::string> names_;  // of all constraints
  double t_ = 0;
  int dof_ = 0;
  bool friction_ = false;
  ImpactLaw law_ = ImpactLaw::kComplementarity;
  // The contacts of the mode, then those of contacts_ at rest.
  Matrix delassus_;  // G
  Matrix reach_;     // P Daᵀ [d × ·]
  Matrix rates_;     // D(Da v) [· × 2d+k]
  Vector restitution_;
  int held_ = 0;              // how many of them are in the mode
  std::vector<int> members_;  // these
  Status status_;
  Status piecewise_linear_;
};

}  // namespace contact_flow
