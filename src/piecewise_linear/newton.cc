// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/newton.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/piecewise_linear/linear_program.h"

namespace contact_flow {
namespace {

constexpr double kStepInCone =
    1e-9;                        // a unit step this far outside counts as on the cone's boundary
constexpr double kEqual = 1e-9;  // model residuals that differ less, relative to |r|, are equal
constexpr double kNoDescent = 1e-10;  // relative decrease of |r|² that is none
constexpr double kGain = 0.5;         // more of a residual within its error is no gain of a step
constexpr const char* kKnownNoBetter = "the residual is known no better";

/// A d in the cone with A d = −r: max t subject to A d + t r = 0, |d_k| ≤ 1, t ≤ 1/|r|, scaled
/// back. Empty when there is none, or none shorter than 1e6 times what |r| and |A| suggest.
Vector AnyInCone(const LinearPiece& piece, const Vector& residual) {
  const int m = static_cast<int>(residual.size()), n = static_cast<int>(piece.matrix.cols());
  const int h = static_cast<int>(piece.cone.rows());
  const double size = piece.matrix.cwiseAbs().maxCoeff();
  if (!(size > 0) || !(residual.norm() > 0)) return Vector();
  const Matrix A = piece.matrix / size;
  const Vector r = residual / residual.norm();
  Matrix rows(h + 2 * m, n + 1);
  rows << piece.cone, Matrix::Zero(h, 1), A, r, -A, -r;
  const Vector upper = Vector::Ones(n + 1);
  Vector lower = -upper;
  lower(n) = 0;
  const std::optional<LinearOptimum> best =
      LinearProgram(rows, lower, upper).Maximize(Vector::Unit(n + 1, n));
  if (!best || best->value < 1e-6) return Vector();
  return best->point.head(n) * (residual.norm() / (size * best->value));
}

/// Asks the clock itself, where AskBudget looks now and then: a run that time has ended is not a
/// residual that is undefined.
void AskAfterRun() {
  std::string sentence;
  const BudgetEnd end = LookAtBudget(&sentence);
  if (end != BudgetEnd::kNone) throw BudgetExceeded(end, sentence);
}

bool Within(const Vector& residual, const Vector& error) {
  return error.size() == residual.size() && (residual.cwiseAbs().array() <= error.array()).all();
}

class Solver {
 public:
  Solver(const NonsmoothEquation& equation, const VectorRef& start, const NewtonOptions& options)
      : equation_(equation), options_(options) {
    result_.x = start;
  }

  NewtonResult Go() {
    try {
      return Iterate();
    } catch (const BudgetExceeded& reason) {
      return End(NewtonStatus::kCancelled, reason.what());
    }
  }

 private:
  NewtonResult Iterate() {
    BudgetStage stage("Newton's method, iteration by iteration");
    EquationValue value = equation_(result_.x, true);
    AskAfterRun();  // and never between a step and its report
    NewtonIteration iteration;
    while (true) {
      if (!value.defined || !value.residual.allFinite()) {
        return End(NewtonStatus::kUndefined, value.message);
      }
      result_.residual = value.residual;
      const double before = iteration.residual;
      iteration.residual = value.residual.cwiseAbs().maxCoeff();
      const bool known = Within(value.residual, value.error);
      result_.iterations.push_back(iteration);
      if (options_.progress && !options_.progress(iteration, result_.x)) {
        return End(NewtonStatus::kCancelled, "the caller asked to stop");
      }
      if (iteration.residual <= options_.tolerance) return End(NewtonStatus::kConverged, "");
      if (known && iteration.iteration > 0 && iteration.residual > kGain * before) {
        return End(NewtonStatus::kConverged, kKnownNoBetter);
      }
      if (iteration.iteration >= options_.max_iterations) {
        return End(NewtonStatus::kMaxIterations,
                   "max_iterations = " + std::to_string(options_.max_iterations) + " were made");
      }
      if (!value.has_map) return End(NewtonStatus::kUndefined, value.message);
      PiecewiseLinearStep step =
          SolvePiecewiseLinear(value.map, value.residual, options_.rank_tolerance);
      const double length = step.d.norm();
      if (options_.max_step > 0 && length > options_.max_step) {
        step.d *= options_.max_step / length;
      }
      // The derivative of ½|r|² along d; f is positively homogeneous.
      const double slope = value.residual.dot(value.map(step.d));
      const double square = value.residual.squaredNorm();
      if (!step.d.allFinite() || !(slope < -kNoDescent * square)) {
        return End(NewtonStatus::kStationary,
                   "no direction that was tried makes the residual smaller to first order");
      }
      iteration.piece = step.piece;
      iteration.in_cone = step.in_cone;
      if (!Search(step.d, slope, square, &value, &iteration)) {
        return known ? End(NewtonStatus::kConverged, kKnownNoBetter)
                     : End(NewtonStatus::kStalled, stall_);
      }
      ++iteration.iteration;
      stage.Next();
    }
  }

  /// Moves x along d; false when no length is accepted.
  bool Search(const Vector& d, double slope, double square, EquationValue* value,
              NewtonIteration* iteration) {
    stall_ = "no step along the Newton direction makes the residual smaller";
    double t = 1;
    for (int halving = 0; halving <= options_.max_halvings; ++halving, t /= 2) {
      const Vector x = options_.add ? options_.add(result_.x, t * d) : Vector(result_.x + t * d);
      EquationValue trial = equation_(x, false);
      AskAfterRun();
      if (!trial.defined) {
        stall_ = "beside the last iterate: " + trial.message;
        continue;
      }
      const double reached = trial.residual.squaredNorm();
      if (!(reached <= square + 2 * options_.armijo * t * slope)) continue;
      const bool done = trial.residual.cwiseAbs().maxCoeff() <= options_.tolerance;
      *value = done ? std::move(trial) : equation_(x, true);
      AskAfterRun();
      result_.x = x;
      iteration->step = t;
      return true;
    }
    return false;
  }

  NewtonResult End(NewtonStatus status, const std::string& reason) {
    result_.status = status;
    std::ostringstream message;
    message << NewtonStatusName(status);
    if (!result_.iterations.empty()) {
      message << " after " << result_.iterations.back().iteration << " iterations, residual "
              << result_.iterations.back().residual;
    }
    if (!reason.empty()) message << ": " << reason;
    result_.message = message.str();
    return std::move(result_);
  }

  const NonsmoothEquation& equation_;
  const NewtonOptions& options_;
  NewtonResult result_;
  std::string stall_;
};

}  // namespace

const char* NewtonStatusName(NewtonStatus status) {
  constexpr const char* kNames[] = {"converged", "stationary",     "stalled",
                                    "undefined", "max iterations", "cancelled"};
  return kNames[static_cast<int>(status)];
}

PiecewiseLinearStep SolvePiecewiseLinear(const PiecewiseLinearMap& map, const VectorRef& residual,
                                         double rank_tolerance) {
  if (residual.size() != map.rows()) {
    throw std::invalid_argument("a residual of " + std::to_string(residual.size()) +
                                " entries beside a map to " + std::to_string(map.rows()));
  }
  PiecewiseLinearStep best;
  best.d = Vector::Zero(map.cols());
  best.model = std::numeric_limits<double>::infinity();
  const double equal = kEqual * residual.norm();
  const auto consider = [&](const Vector& d, std::size_t i) {
    const double model = (residual + map(d)).norm();
    const bool better =
        model < best.model - equal || (model <= best.model + equal && d.norm() < best.d.norm());
    if (!d.allFinite() || !better) return;
    best.d = d;
    best.model = model;
    best.piece = static_cast<int>(i);
    best.in_cone = map.pieces()[i].Margin(d) >= -kStepInCone * d.norm();
  };
  for (std::size_t i = 0; i < map.pieces().size(); ++i) {
    Eigen::JacobiSVD<Matrix> parts(map.pieces()[i].matrix,
                                   Eigen::ComputeThinU | Eigen::ComputeThinV);
    parts.setThreshold(rank_tolerance);
    consider(parts.solve(-residual), i);
  }
  if (best.model > equal && map.cols() > map.rows()) {
    for (std::size_t i = 0; i < map.pieces().size(); ++i) {
      const Vector d = AnyInCone(map.pieces()[i], residual);
      if (d.size() > 0) consider(d, i);
    }
  }
  return best;
}

NewtonResult SolveEquation(const NonsmoothEquation& equation, const VectorRef& start,
                           const NewtonOptions& options) {
  return Solver(equation, start, options).Go();
}

}  // namespace contact_flow
