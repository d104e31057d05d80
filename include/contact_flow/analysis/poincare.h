// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/analysis/return_section.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"

namespace contact_flow {

/// How a return came out.
enum class ReturnStatus {
  kReturned = 0,
  kNoReturn = 1,      ///< the section was not crossed within the horizon
  kStopped = 2,       ///< the run ended before: Zeno, grazing, budget, …
  kTangent = 3,       ///< the section is touched rather than crossed, ds F = 0
  kNoDerivative = 4,  ///< returned, but the return map has no derivative here; the message says why
  kRefused = 5,       ///< the start is no admissible state
};

/// "returned", …
const char* ReturnStatusName(ReturnStatus status);

/// An event whose time is wanted.
struct WantedEvent {
  int constraint = 0;    ///< its index
  bool release = false;  ///< lift-off, else touchdown
  int occurrence = 1;    ///< the first, second, … of the return
};

/// One return.
struct PoincareReturn {
  ReturnStatus status = ReturnStatus::kNoReturn;  ///< how it came out
  std::string message;                            ///< why, as a sentence
  double time = 0;                                ///< of the return [s]
  Vector x;                                       ///< P(x) [nq+d], with the section's symmetry
  Trajectory trajectory;  ///< to the return; for Kind::kEvent it ends with an arc of no length
                          ///< behind the event
  double crossing_speed = Margins::kNone;  ///< ds F there, the margin of transversality
  double symmetry_residual = 0;  ///< how far the section's symmetry is from being one, relative
  Vector event_times;            ///< of the wanted events [s]; NaN for one that did not happen
  /// With a derivative only. A direction may make a start slip that sticks; where that has no
  /// pieces, `map`, `return_time` and `extended` are those of its part in the span of start_basis.
  PiecewiseLinearMap map;          ///< DP on all tangents (δq, δv, δu, δp) [2d × 2d+k]
  PiecewiseLinearMap return_time;  ///< its derivative [1 × 2d+k]
  PiecewiseLinearMap extended;  ///< rows of DP, of the return time and of the event times together
  /// Orthonormal, of the admissible tangents of the section [2d×·], but for rates of clocks; of one
  /// size they are turned to agree, so that on an orbit they are the same.
  Matrix start_basis;
  Matrix end_basis;            ///< the same at the return
  PiecewiseLinearMap reduced;  ///< endᵀ DP start: no spurious zero

  /// Whether the section was reached again.
  bool returned() const {
    return status == ReturnStatus::kReturned || status == ReturnStatus::kNoDerivative;
  }
};

/// Settings of the return map.
struct PoincareOptions {
  SimulateOptions simulate;         ///< tolerances of 1e-12 by default; `dense` is set as needed
  BDerivativeOptions derivative;    ///< its variables are those of the maps
  std::vector<WantedEvent> events;  ///< whose times are wanted as well
  double horizon = 10;              ///< longest return [s]
  double shortest = 1e-3;           ///< crossings before are the start itself [s]

  PoincareOptions() {
    simulate.relative_tolerance = simulate.absolute_tolerance = 1e-12;
    derivative.tolerance = 1e-11;
  }
};

/// The first return map P of a section, with its B-derivative
///   DP = (I − F ds / (ds F)) B        (for an event, followed by its first-order map).
/// A crossing is looked for on the dense output, in 16 parts of a step and where it turns inside a
/// part, and then settled by Newton's method on runs that end there: s = 0 to rounding. A jump of
/// the sign at an impact is none.
/// With a symmetry g in the section, P = g ∘ (first return) and DP = Dg (…); a return at which g is
/// not one of M, f + c v and the contacts in force is refused; with a derivative also one whose
/// translation changes the motion, and an orbit whose next return is not the image of this one, to
/// first order.
/// Tangents of the section keep what the contact mode holds, slips of sticking contacts among it,
/// and behind an event the gaps of all contacts that touch: nothing returns across these.
class PoincareMap {
 public:
  /// `system` must outlive the map. Throws std::invalid_argument for a section the system has not.
  PoincareMap(const MechanicalSystem& system, const VectorRef& u, const Section& section,
              const PoincareOptions& options = {});

  /// P(x), and DP when `differentiate`. x need not lie on the section.
  PoincareReturn Return(const VectorRef& x, bool differentiate = true) const;

  /// Where it returns to.
  const Section& section() const { return section_; }

 private:
  double Height(const VectorRef& x, Vector* gradient) const {
    return section_.Height(system_, x, gradient);
  }
  bool FindReturn(const VectorRef& x, double duration, PoincareReturn* result) const;
  bool FindEvent(const VectorRef& x, Trajectory run, PoincareReturn* result) const;
  void Settle(const VectorRef& x, PoincareReturn* result) const;
  bool AtAnEvent(const VectorRef& x, const PoincareReturn& result) const;
  void Differentiate(const VectorRef& x, PoincareReturn* result) const;
  PiecewiseLinearMap Extended(const BDerivative& B, const PiecewiseLinearMap& first,
                              const PoincareReturn& result) const;
  PiecewiseLinearMap ThroughEvent(const PoincareReturn& result) const;
  bool RestitutionRises(const Transition& event) const;
  bool ApplySymmetry(const VectorRef& x, PoincareReturn* result) const;
  Matrix Basis(const VectorRef& x, ContactMode mode) const;
  ConstraintSet Touching(const VectorRef& x) const;

  const MechanicalSystem& system_;
  const Vector u_;
  const Section section_;
  const PoincareOptions options_;
};

}  // namespace contact_flow
