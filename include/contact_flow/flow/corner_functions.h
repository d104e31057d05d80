// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/effort_limits.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/spline_knots.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Functions of the state with values, corners, at which the derivatives of f jump while f is
/// continuous: the shares of efforts at their limits ±1 (EffortLimits), then the places of contacts
/// at the knots of their surfaces (SplineKnots). A run ends its steps there.
class CornerFunctions {
 public:
  /// `system` must outlive it.
  explicit CornerFunctions(const MechanicalSystem& system);

  bool Empty() const { return corners_.empty(); }
  int size() const { return static_cast<int>(corners_.size()); }
  /// The first functions, those of limited efforts.
  int num_efforts() const { return num_efforts_; }
  /// Of function i, ascending.
  const std::vector<double>& corners(int i) const { return corners_[static_cast<std::size_t>(i)]; }

  /// All of them at x [size]; NaN where one has no corners in this mode.
  void Evaluate(const Vector& x, const VectorRef& u, ContactMode mode, Vector* value) const;
  /// How many corners of function i lie below this value; none where it is at one, or NaN.
  std::optional<int> Piece(int i, double value) const;
  /// From x to the next knot of a function of time [s]; infinity where none follows. One within
  /// the rounding of `t` is at x.
  double TimeToKnot(const Vector& x) const;

 private:
  const MechanicalSystem& system_;
  const EffortLimits* limits_;
  const SplineKnots* knots_;
  std::vector<std::vector<double>> corners_;
  int num_efforts_ = 0;
};

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
/// The instants inside an arc at which the derivatives of f jump, ascending, alike [s].
std::vector<double> CornerInstants(const MechanicalSystem& system, const Arc& arc);

}  // namespace contact_flow
