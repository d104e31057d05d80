// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "contact_flow/flow/stepper.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/effort_limits.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Where efforts stand beside their limits: −1 or 1 beyond one, 0 between them.
enum class EffortPiece : int { kLower = -1, kFree = 0, kUpper = 1 };

/// "lower", "free" or "upper".
const char* EffortPieceName(EffortPiece piece);

/// An effort passes one of its limits.
struct LimitPassing {
  double t = 0;    ///< [s]
  int effort = 0;  ///< its index in EffortLimits::limited_efforts
  EffortPiece before = EffortPiece::kFree;
  EffortPiece after = EffortPiece::kFree;
};

/// Those inside an arc, in the order of time, from its dense output: a run ends its steps at them.
/// Empty for systems without EffortLimits, and for arcs without dense output.
std::vector<LimitPassing> LimitPassings(const MechanicalSystem& system, const Arc& arc);

/// Finds where in a step of the integrator an effort first passes a limit. The field is continuous
/// there: what is not found (a limit that is exceeded for a part of the step) is left to the error
/// control of the step. A limit that is touched is not passed.
class LimitLocator {
 public:
  explicit LimitLocator(const MechanicalSystem& system);

  bool HasLimits() const { return limits_ != nullptr; }
  /// A zero of r − bound, r the share of an effort, at θ of the step.
  struct Zero {
    int effort = 0;
    double bound = 0;
    double theta = 1;
  };
  /// The earliest one in the finished step, if any.
  std::optional<Zero> Locate(Stepper* stepper, const VectorRef& u, ContactMode mode);
  /// r − bound at the end of the step, and its rate there [1/s].
  double AtEnd(const Stepper& stepper, const Zero& zero, const VectorRef& u, ContactMode mode,
               double* rate);

 private:
  static constexpr int kSamples = 5;

  void Shares(const Vector& x, Vector* share);
  /// r at the beginning or end of the step into `share`, and its rates times the step.
  void SharesAndRates(const Vector& x, const VectorRef& xdot, double h, Vector* share,
                      Vector* rate);
  bool MayPass();
  double Turn(int effort, int j) const;
  std::optional<Zero> FirstZero(Stepper* stepper, int effort);
  double ShareAt(Stepper* stepper, int effort, double theta);
  double Root(Stepper* stepper, int effort, double bound, double begin, double end);

  const MechanicalSystem& system_;
  const EffortLimits* limits_;
  Vector u_;
  ContactMode mode_;
  Vector x_, share_, moved_;
  Vector begin_, begin_rate_, end_, end_rate_;
  Matrix samples_;  // [efforts × kSamples]
};

}  // namespace contact_flow
