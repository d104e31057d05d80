// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/corner_functions.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

/// A value this near to a corner is on neither side of it, beside max(1, |corner|).
constexpr double kAtCorner = 1e-12;

/// Function i leaves one piece for another.
struct Passing {
  double t;
  int function;
  int before, after;
};

/// Those inside the arc, by the middles of its steps: at their beginnings.
std::vector<Passing> Passings(const CornerFunctions& functions, int state_size, const Arc& arc) {
  std::vector<Passing> passings;
  std::vector<std::optional<int>> last(static_cast<std::size_t>(functions.size()));
  Vector x(state_size), value;
  for (std::size_t k = 0; k < arc.dense.NumSteps() && !functions.Empty(); ++k) {
    const double begin = std::max(arc.t_begin, arc.dense.StepBegin(k));
    const double end = std::min(arc.t_end, arc.dense.StepBegin(k) + arc.dense.StepLength(k));
    if (!(begin < end)) continue;
    arc.dense.Evaluate(0.5 * (begin + end), x.data());
    functions.Evaluate(x, arc.u, arc.mode, &value);
    for (int i = 0; i < functions.size(); ++i) {
      const std::optional<int> piece = functions.Piece(i, value(i));
      std::optional<int>& known = last[static_cast<std::size_t>(i)];
      if (!piece) continue;
      if (known && *known != *piece) passings.push_back({begin, i, *known, *piece});
      known = piece;
    }
  }
  return passings;
}

}  // namespace

const char* EffortPieceName(EffortPiece piece) {
  static constexpr const char* kNames[] = {"lower", "free", "upper"};
  return kNames[static_cast<int>(piece) + 1];
}

CornerFunctions::CornerFunctions(const MechanicalSystem& system)
    : system_(system),
      limits_(dynamic_cast<const EffortLimits*>(&system)),
      knots_(dynamic_cast<const SplineKnots*>(&system)) {
  if (limits_ != nullptr) corners_.assign(limits_->limited_efforts().size(), {-1, 1});
  num_efforts_ = size();
  if (knots_ == nullptr) return;
  const std::vector<std::vector<double>>& places = knots_->knots_of_places();
  corners_.insert(corners_.end(), places.begin(), places.end());
}

void CornerFunctions::Evaluate(const Vector& x, const VectorRef& u, ContactMode mode,
                               Vector* value) const {
  const auto q = x.head(system_.num_positions()), v = x.tail(system_.dof());
  if (size() == num_efforts_) return limits_->EffortShares(q, v, u, mode, value);
  if (num_efforts_ == 0) return knots_->Places(q, mode, value);
  Vector share, place;
  limits_->EffortShares(q, v, u, mode, &share);
  knots_->Places(q, mode, &place);
  value->resize(size());
  *value << share, place;
}

std::optional<int> CornerFunctions::Piece(int i, double value) const {
  const std::vector<double>& at = corners(i);
  const auto behind = std::lower_bound(at.begin(), at.end(), value);
  const auto beside = [&](double corner) {
    return std::abs(value - corner) <= kAtCorner * std::max(1.0, std::abs(corner));
  };
  if (std::isnan(value) || (behind != at.end() && beside(*behind))) return std::nullopt;
  if (behind != at.begin() && beside(*(behind - 1))) return std::nullopt;
  return static_cast<int>(behind - at.begin());
}

double CornerFunctions::TimeToKnot(const Vector& x) const {
  if (knots_ == nullptr) return std::numeric_limits<double>::infinity();
  return knots_->TimeToKnot(x.head(system_.num_positions()), x.tail(system_.dof()));
}

std::vector<LimitPassing> LimitPassings(const MechanicalSystem& system, const Arc& arc) {
  const CornerFunctions functions(system);
  std::vector<LimitPassing> passings;
  if (functions.num_efforts() == 0) return passings;
  for (const Passing& passing : Passings(functions, system.state_size(), arc)) {
    if (passing.function >= functions.num_efforts()) continue;
    passings.push_back({passing.t, passing.function, static_cast<EffortPiece>(passing.before - 1),
                        static_cast<EffortPiece>(passing.after - 1)});
  }
  return passings;
}

std::vector<double> CornerInstants(const MechanicalSystem& system, const Arc& arc) {
  const CornerFunctions functions(system);
  std::vector<double> instants;
  for (const Passing& passing : Passings(functions, system.state_size(), arc)) {
    instants.push_back(passing.t);
  }
  if (!std::isfinite(functions.TimeToKnot(arc.x_begin))) return instants;
  Vector x(system.state_size());
  for (std::size_t k = 1; k < arc.dense.NumSteps(); ++k) {
    // A step of the run begins at a knot of time: the next one from the middle of the step before.
    const double begin = arc.dense.StepBegin(k);
    const double middle = arc.dense.StepBegin(k - 1) + 0.5 * arc.dense.StepLength(k - 1);
    if (!(begin > arc.t_begin && begin < arc.t_end)) continue;
    arc.dense.Evaluate(middle, x.data());
    const double knot = middle + functions.TimeToKnot(x);
    if (knot <= begin + kAtCorner * std::max(1.0, std::abs(begin))) instants.push_back(begin);
  }
  std::sort(instants.begin(), instants.end());
  return instants;
}

}  // namespace contact_flow
