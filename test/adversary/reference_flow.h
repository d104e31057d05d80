// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/dynamics/impact.h"
#include "contact_flow/flow/input_schedule.h"
#include "test/adversary/random_system.h"
#include "test/adversary/reference_dynamics.h"

namespace contact_flow {
namespace adversary {

/// Solves 0 ≤ z ⟂ w = G z + b ≥ 0 by trying all supports, the one that violates least.
struct EnumeratedSolution {
  Vector z;
  unsigned support = 0;
  double violation = 0;  ///< largest negative part of z, w, relative
  double clearance = 0;  ///< smallest max(z_i, w_i), relative: 0 where it is degenerate
};
EnumeratedSolution EnumerateComplementarity(const Matrix& G, const Vector& b);

/// In increasing order.
std::vector<int> Members(ConstraintSet set);

struct ReferenceOptions {
  double largest_step = 0.05;  ///< [s]
  double tolerance = 1e-13;    ///< of a step, relative to max(1, |x|)
  double feature = 0.5;        ///< largest step in units of RandomSystem::TimeScale
  long max_events = 400;
  long max_idle = 10;     ///< in a row that change no mode and no velocity
  double no_time = 1e-9;  ///< and are no further apart [s]
  long max_steps = 20000;
  ImpactLaw law = ImpactLaw::kComplementarity;
};

/// One event of a reference run.
struct ReferenceEvent {
  double t = 0;
  ConstraintSet activated, before, after;
};

struct ReferenceRun {
  /// Empty when the run is good; else the reason why it decides nothing.
  std::string doubt;
  Vector x;
  std::vector<ReferenceEvent> events;
  bool settled = false;  ///< bounces below the speed floor were taken as rest
  double lost = 0;  ///< largest speed of a hop taken as rest: too low for this gap to tell [m/s]
  /// Smallest approach speed, and smallest depth of a gap that stayed open, [m/s] and [m].
  double approach = 1e300;
  double gap = 1e300;
};

/// A simulator of its own, slow and simple, for systems in units of order 1: extrapolated midpoint
/// steps no longer than what forces and gaps need, guards looked at on a quintic through each step,
/// events by bisection on true steps, complementarity by enumeration.
class ReferenceFlow {
 public:
  static constexpr double kGap = 1e-12;  ///< counts as touching [m]

  ReferenceFlow(const RandomSystem& system, const ReferenceOptions& options)
      : system_(system), options_(options), dynamics_(system) {}

  /// The contact mode at x: what touches and rests and is pressed.
  ConstraintSet InitialMode(const Vector& x, const Vector& u, std::string* doubt);
  /// From x, with the contacts in `held` put exactly in contact first.
  ReferenceRun Run(Vector x, const InputSchedule& schedule, double duration, ConstraintSet held);
  /// Without events, in one mode, for `duration` (may be negative).
  bool Glide(Vector* x, const Vector& u, ConstraintSet mode, double duration);
  /// Moves x to where the gaps and rates of `held` vanish.
  void PutInContact(Vector* x, ConstraintSet held);

 private:
  static constexpr double kRest = 1e-10;      // counts as resting [m/s]
  static constexpr double kRounding = 2e-15;  // of a gap [m]
  struct Event {
    double s = 0;
    int constraint = -1;
  };
  /// Extrapolated midpoint step; error estimate relative.
  double Step(const Vector& x, double h, Vector* y);
  SmallState Field(const SmallState& x);
  double Limit(const Vector& x) const;
  double Guard(const VectorRef& x, int i);
  /// The first event of the step from x to y of length h; constraint −1: none.
  Event FirstEvent(const Vector& x, const Vector& y, double h, ReferenceRun* run);
  bool Impact(Vector* x, ConstraintSet touching);
  ConstraintSet Decide(Vector* x, ConstraintSet candidates, std::string* doubt);
  void Resolve(Vector* x, int trigger, double t, ReferenceRun* run);

  const RandomSystem& system_;
  const ReferenceOptions options_;
  Vector u_;
  ConstraintSet mode_;
  ReferenceDynamics dynamics_;
  ConstraintTerms terms_;
};

}  // namespace adversary
}  // namespace contact_flow
