// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/descent.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr double kAccept = 0.1, kGood = 0.75;       // shares of the promised decrease
constexpr double kArmijo = 1e-4, kCurvature = 0.9;  // weak Wolfe
constexpr int kMaxLineSearch = 60;
constexpr double kNoDecrease = 1e-15;  // relative decrease that is none

class Descent {
 public:
  Descent(const NonsmoothCost& cost, const VectorRef& start, const DescentOptions& options)
      : cost_(cost), options_(options), y_(start) {}

  DescentResult Go() {
    const BudgetStage stage("the descent");
    try {
      Search();
    } catch (const BudgetExceeded& reason) {
      End(DescentStatus::kCancelled, reason.what());
    }
    if (result_.status == DescentStatus::kCancelled && result_.iterations.empty()) {
      result_.y = y_;
      result_.message = std::string(DescentStatusName(result_.status)) + ": " + reason_;
      return std::move(result_);
    }
    Conclude();
    return std::move(result_);
  }

 private:
  static bool Usable(const CostValue& value) {
    return value.defined && value.has_map && std::isfinite(value.cost);
  }

  void Search() {
    const CostValue start = cost_(y_, CostQuery::kKinks);
    if (!Usable(start)) return End(DescentStatus::kUndefined, start.message);
    J_ = start.cost;
    if (!Report(DescentMethod::kStart, 0)) return;
    double radius = options_.radius;
    while (true) {
      const double before = J_;
      if (!TrustRegion(&radius) || !Bfgs()) return;
      if (!(J_ < before - kNoDecrease * std::abs(before))) {
        return End(DescentStatus::kStalled, "no step makes the cost smaller");
      }
      radius = std::max(radius, 1e3 * options_.smallest_radius);
    }
  }

  /// Steps until they are refused `patience` times; false when the end was reached.
  bool TrustRegion(double* radius) {
    int refused = 0;
    CostValue value = cost_(y_, CostQuery::kKinks);
    while (refused<options_.patience&& * radius> options_.smallest_radius) {
      if (!Usable(value)) return true;
      const SteepestDescent steepest = FindSteepestDescent(value.map);
      if (steepest.slope >= -options_.tolerance) {
        const double before = J_;
        const bool on_kink = value.map.pieces().size() > 1;
        if (on_kink && !Bfgs()) return false;  // the kink is near: go there
        if (J_ < before) {
          value = cost_(y_, CostQuery::kKinks);
          continue;
        }
        End(DescentStatus::kMinimum, "");
        return false;
      }
      const Vector y = y_ + *radius * steepest.d;
      const CostValue trial = cost_(y, CostQuery::kKinks);
      AskBudget();
      const double ratio = Usable(trial) ? (trial.cost - J_) / (*radius * steepest.slope) : -1;
      if (!(ratio >= kAccept)) {
        *radius /= 4;
        ++refused;
        continue;
      }
      refused = 0;
      y_ = y;
      J_ = trial.cost;
      value = trial;
      if (!Report(DescentMethod::kTrustRegion, *radius)) return false;
      if (ratio >= kGood) *radius *= 2;
    }
    return true;
  }

  /// The gradient of the piece that is entered along d; of the first where d is empty.
  static Vector Gradient(const CostValue& value, const Vector& d) {
    const int piece = d.size() > 0 ? value.map.PieceAt(d) : 0;
    return value.map.pieces()[piece].matrix.row(0).transpose();
  }

  /// Quasi-Newton steps until the line search finds none; false when the end was reached.
  bool Bfgs() {
    const Eigen::Index n = y_.size();
    CostValue value = cost_(y_, CostQuery::kSlopes);
    if (!Usable(value)) return true;
    Vector g = Gradient(value, FindSteepestDescent(value.map).d);
    Matrix H = Matrix::Identity(n, n);
    bool scaled = false;
    while (true) {
      AskBudget();
      if (FindSteepestDescent(value.map).slope >= -options_.tolerance) {
        End(DescentStatus::kMinimum, "");
        return false;
      }
      Vector d = -H * g;
      if (!(value.map(d)(0) < 0)) {  // not at a kink's right side, or H is spoilt
        d = FindSteepestDescent(value.map).d;
        H = Matrix::Identity(n, n);
        scaled = false;
      }
      if (!scaled) d *= std::min(1.0, options_.radius / std::max(d.cwiseAbs().maxCoeff(), 1e-300));
      CostValue next;
      const double t = WeakWolfe(d, value, &next);
      if (!(t > 0)) return true;
      const Vector s = t * d, g_next = Gradient(next, d);
      const Vector change = g_next - g;
      const double curvature = change.dot(s);
      if (curvature > 1e-14 * change.norm() * s.norm()) {
        if (!scaled) H = Matrix::Identity(n, n) * (curvature / change.squaredNorm());
        scaled = true;
        const Matrix V = Matrix::Identity(n, n) - s * change.transpose() / curvature;
        H = (V * H * V.transpose() + s * s.transpose() / curvature).eval();
      }
      const double before = J_;
      y_ += s;
      J_ = next.cost;
      g = g_next;
      value = next;
      if (!Report(DescentMethod::kBfgs, s.cwiseAbs().maxCoeff())) return false;
      if (!(J_ < before - kNoDecrease * std::abs(before))) return true;
    }
  }

  /// The length t of a step that fulfils the weak conditions of Wolfe, by bracketing; the longest
  /// that meets Armijo's alone where none does; 0 when there is none.
  double WeakWolfe(const Vector& d, const CostValue& value, CostValue* reached) {
    const double slope = value.map(d)(0);
    double low = 0, high = std::numeric_limits<double>::infinity(), t = 1;
    for (int k = 0; k < kMaxLineSearch; ++k) {
      const CostValue trial = cost_(y_ + t * d, CostQuery::kSlopes);
      AskBudget();
      if (!Usable(trial) || !(trial.cost <= J_ + kArmijo * t * slope)) {
        high = t;
      } else {
        low = t;
        *reached = trial;
        if (trial.map(d)(0) >= kCurvature * slope) return t;
      }
      t = std::isfinite(high) ? 0.5 * (low + high) : 2 * low;
      if (std::isfinite(high) && high - low <= 1e-14 * high) break;
    }
    return low;
  }

  /// Records the iterate; false when the search is to end.
  bool Report(DescentMethod method, double step) {
    const int number = static_cast<int>(result_.iterations.size());
    result_.iterations.push_back({number, J_, step, method});
    if (options_.progress && !options_.progress(result_.iterations.back(), y_)) {
      End(DescentStatus::kCancelled, "the caller asked to stop");
      return false;
    }
    if (number >= options_.max_iterations) {
      End(DescentStatus::kMaxIterations,
          "max_iterations = " + std::to_string(options_.max_iterations) + " were made");
      return false;
    }
    return true;
  }

  void End(DescentStatus status, const std::string& reason) {
    result_.status = status;
    reason_ = reason;
  }

  /// What the end is: minimum or not, valley or ridge.
  void Conclude() {
    result_.y = y_;
    result_.cost = J_;
    const CostValue value = cost_(y_, CostQuery::kKinks);
    if (Usable(value)) {
      result_.steepest = FindSteepestDescent(value.map);
      result_.kinks = FindKinks(value.map, options_.kink_tolerance);
      if (result_.status == DescentStatus::kStalled &&
          result_.steepest.slope >= -options_.tolerance) {
        result_.status = DescentStatus::kMinimum;
        reason_.clear();
      }
    }
    std::ostringstream message;
    message << DescentStatusName(result_.status);
    if (!result_.iterations.empty()) {
      message << " after " << result_.iterations.size() - 1 << " iterations, cost " << J_;
    }
    long valleys = 0;
    for (const Kink& kink : result_.kinks) valleys += kink.IsValley();
    const long ridges = static_cast<long>(result_.kinks.size()) - valleys;
    if (valleys > 0) message << ", in " << valleys << " valley" << (valleys > 1 ? "s" : "");
    if (ridges > 0) message << ", on " << ridges << " ridge" << (ridges > 1 ? "s" : "");
    if (!reason_.empty()) message << ": " << reason_;
    result_.message = message.str();
  }

  const NonsmoothCost& cost_;
  const DescentOptions& options_;
  Vector y_;
  double J_ = 0;
  std::string reason_;
  DescentResult result_;
};

}  // namespace

const char* DescentStatusName(DescentStatus status) {
  constexpr const char* kNames[] = {"minimum",        "stalled", "undefined",
                                    "max iterations", "",        "cancelled"};
  return kNames[static_cast<int>(status)];
}

DescentResult Minimize(const NonsmoothCost& cost, const VectorRef& start,
                       const DescentOptions& options) {
  const auto check = [](const char* name, bool is_right, double value, const char* expected) {
    if (is_right) return;
    std::ostringstream message;
    message << name << " is " << value << ", expected " << expected;
    throw std::invalid_argument(message.str());
  };
  check("radius", options.radius > 0 && std::isfinite(options.radius), options.radius,
        "a number > 0");
  check("tolerance", options.tolerance >= 0 && std::isfinite(options.tolerance), options.tolerance,
        "a number ≥ 0");
  check("max_iterations", options.max_iterations >= 0, options.max_iterations, "≥ 0");
  return Descent(cost, start, options).Go();
}

}  // namespace contact_flow
