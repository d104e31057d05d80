// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <sstream>

#include "contact_flow/budget.h"
#include "search.h"

namespace contact_flow {
namespace {

constexpr int kMaxUpdates = 60;
/// The first ρ brings a condition to this part of what it would be missed by without.
constexpr double kFirstPart = 1e-2;
/// A condition whose gap does not fall to this part has its ρ raised by that factor.
constexpr double kFall = 0.25, kRaise = 10, kMostRaised = 1e18;
/// Gaps below this part of the tolerance are no longer reduced.
constexpr double kEnough = 1e-2;
constexpr double kLeastTolerance = 1e-16;

}  // namespace

/// Descents of L, with λ ← ρ r after each, until the conditions hold.
void Search::Solve(FacePoint point) {
  const TrajectoryProblem& problem = unknowns_.problem();
  if (problem.conditions.empty()) return Descend(point);
  if (multipliers_.rho.size() == 0 && !BeginMultipliers(point)) return;
  tolerance_ = options_.tolerance;
  Vector before = multipliers_.Gaps(problem.conditions, point.values);
  for (int update = 0; update < kMaxUpdates; ++update) {
    point = best_ = At(point.y);
    curvature_.Forget();
    if (!std::isfinite(point.cost)) {
      return End(TrajectoryVerdict::kStalled, "the run is not repeated");
    }
    const std::size_t iterations = result_.iterations.size();
    Descend(point);
    if (Ended() || result_.verdict == TrajectoryVerdict::kUndefined) return;
    point = best_;
    const Vector after = multipliers_.Gaps(problem.conditions, point.values);
    const bool falls = after.maxCoeff() < kFall * before.maxCoeff();
    const bool holds = after.maxCoeff() <= problem.condition_tolerance;
    if (after.maxCoeff() <= kEnough * problem.condition_tolerance || (holds && !falls)) return;
    if (update + 1 == kMaxUpdates) break;
    if (result_.iterations.size() == iterations) {  // nothing was left to do for this tolerance
      tolerance_ = std::max(tolerance_ / 100, kLeastTolerance);
    }
    multipliers_.Update(problem.conditions, point.values);
    if (update > 0) Raise(before, after);
    before = after;
  }
  if (best_.violation <= problem.condition_tolerance) return;
  if (no_derivative_) return End(TrajectoryVerdict::kStalled, reason_ + "; " + WorstCondition());
  End(TrajectoryVerdict::kInfeasible, WorstCondition());
}

/// λ = 0, and ρ by what Σ c_i²/H_ii says of how easily each condition is met by unknowns that cost;
/// how far others are to go for it has no scale in their units.
bool Search::BeginMultipliers(const FacePoint& point) {
  const PieceModels models = ModelsAt(point.y);
  if (!models.status.ok()) {
    End(TrajectoryVerdict::kUndefined, models.status.message);
    return false;
  }
  const PieceModel& piece = models.pieces.front();
  const Vector diagonal = piece.hessian.diagonal();
  const Vector ease = (diagonal.array() > 0).select(diagonal.cwiseInverse(), 0.0);
  const Eigen::Index count = piece.conditions.rows();
  multipliers_.lambda = Vector::Zero(count);
  multipliers_.rho = Vector::Ones(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double sum = piece.conditions.row(i).cwiseAbs2().dot(ease);
    if (sum > 0 && std::isfinite(sum)) multipliers_.rho(i) = 1 / (kFirstPart * sum);
  }
  first_rho_ = multipliers_.rho;
  return true;
}

void Search::Raise(const Vector& before, const Vector& after) {
  for (Eigen::Index i = 0; i < after.size(); ++i) {
    const bool missed = after(i) > unknowns_.problem().condition_tolerance;
    if (!missed || after(i) <= kFall * before(i)) continue;
    multipliers_.rho(i) = std::min(kRaise * multipliers_.rho(i), kMostRaised * first_rho_(i));
  }
}

std::string Search::WorstCondition() const {
  const std::vector<TrajectoryCondition>& conditions = unknowns_.problem().conditions;
  const Vector off = Violations(conditions, best_.values);
  Eigen::Index worst = 0;
  const double largest = off.maxCoeff(&worst);
  std::ostringstream text;
  text.precision(4);
  text << conditions[static_cast<std::size_t>(worst)].Describe(
              unknowns_.system().description(), unknowns_.problem().inputs.grid.size())
       << " is " << best_.values(worst) << ", " << largest << " off its bounds";
  return text.str();
}

}  // namespace contact_flow
