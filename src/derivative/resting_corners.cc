// SPDX-License-Identifier: BSD-3-Clause
#include "resting_corners.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/corner_functions.h"

namespace contact_flow {
namespace {

/// A state or an input is moved by this part of 1 or itself, to see whether a function moves too;
/// then so far that the function is this far from its corner, beside max(1, |corner|).
constexpr double kProbe = 1e-6, kAside = 1e-7;
/// What is moved further than this part of 1 or itself does not move the function.
constexpr double kFarthest = 1e-3;
/// Entries of DF that differ by no more, beside their sizes and beside the largest, are the same.
constexpr double kSameSlope = 1e-4, kNoCorner = 1e-9;

/// A step that lasts no longer than this part of its arc is one in which the function passes its
/// corner, or touches it where the arc begins or ends: what it tells of slopes is nothing.
constexpr double kInstant = 1e-8;

/// The two sides of a corner on which the motion rests.
class RestingCorner {
 public:
  RestingCorner(const ContactDynamics& dynamics, const CornerFunctions& functions, const Arc& arc,
                int function, const Vector& x)
      : system_(dynamics.system()),
        variables_(dynamics.variables()),
        functions_(functions),
        arc_(arc),
        function_(function),
        x_(x),
        value_(ValueAt(Vector::Zero(NumTangents()))) {}

  /// Whether DF is another one on either side. What nothing moves but parameters has one side only
  /// where none of these is a variable.
  bool HasTwoSides() const {
    Vector aside;
    if (!MovedBy(&aside)) return !variables_.parameters.empty();
    try {
      const Matrix one = JacobianAt(aside), other = JacobianAt(-aside);
      const double nothing =
          kNoCorner * std::max(one.cwiseAbs().maxCoeff(), other.cwiseAbs().maxCoeff());
      const auto sizes = kSameSlope * (one.cwiseAbs() + other.cwiseAbs()).array() + nothing;
      return !((one - other).array().abs() <= sizes).all();  // NaN, too
    } catch (const FrictionRefusal&) {
      return true;
    }
  }

 private:
  /// Of the state, then of the input.
  Eigen::Index NumTangents() const { return 2 * system_.dof() + arc_.u.size(); }
  Vector StateAt(const Vector& aside) const {
    return system_.Perturb(x_, aside.head(2 * system_.dof()));
  }
  Vector InputAt(const Vector& aside) const { return arc_.u + aside.tail(arc_.u.size()); }

  double ValueAt(const Vector& aside) const {
    Vector value;
    functions_.Evaluate(StateAt(aside), InputAt(aside), arc_.mode, &value);
    return value(function_);
  }
  Matrix JacobianAt(const Vector& aside) const {
    ContactDynamics dynamics(system_, InputAt(aside), variables_);
    dynamics.Differentiate(StateAt(aside), arc_.mode);
    return dynamics.acceleration_jacobian();
  }

  /// What moves the function most, as a tangent that moves it a little; false if nothing does.
  bool MovedBy(Vector* aside) const {
    double best = 0;
    for (Eigen::Index j = 0; j < NumTangents(); ++j) {
      const Eigen::Index input = j - 2 * system_.dof();
      const double size = input < 0 ? 1 : std::max(1.0, std::abs(arc_.u(input)));
      const Vector probe = kProbe * size * Vector::Unit(NumTangents(), j);
      const double moved =
          std::max(std::abs(ValueAt(probe) - value_), std::abs(ValueAt(-probe) - value_));
      const double scale = kAside * std::max(1.0, std::abs(value_)) / moved;
      if (!(moved > best) || !(kProbe * scale <= kFarthest)) continue;
      best = moved;
      *aside = scale * probe;
    }
    return best > 0;
  }

  const MechanicalSystem& system_;
  const Variables& variables_;
  const CornerFunctions& functions_;
  const Arc& arc_;
  const int function_;
  const Vector x_;
  const double value_;
};

/// The functions that are at a corner in the middle of a step and a quarter beside it.
std::vector<int> Resting(const CornerFunctions& functions, const Arc& arc, double begin,
                         double end) {
  std::vector<int> resting(static_cast<std::size_t>(functions.size()));
  std::iota(resting.begin(), resting.end(), 0);
  Vector x = arc.x_begin, value;
  for (const double part : {0.5, 0.25, 0.75}) {
    if (resting.empty()) break;
    arc.dense.Evaluate(begin + part * (end - begin), x.data());
    functions.Evaluate(x, arc.u, arc.mode, &value);
    const auto leaves = [&](int i) {
      return std::isnan(value(i)) || functions.Piece(i, value(i)).has_value();
    };
    resting.erase(std::remove_if(resting.begin(), resting.end(), leaves), resting.end());
  }
  return resting;
}

std::string NameOf(const MechanicalSystem& system, const CornerFunctions& functions, int i) {
  if (i >= functions.num_efforts()) return "a contact moves along a knot of its surface";
  const auto& efforts = dynamic_cast<const EffortLimits&>(system).limited_efforts();
  return "the effort '" + efforts[static_cast<std::size_t>(i)] + "' is right on its limit";
}

}  // namespace

Status CheckRestingCorners(const ContactDynamics& dynamics, const Arc& arc) {
  const CornerFunctions functions(dynamics.system());
  if (functions.Empty()) return {};
  for (std::size_t k = 0; k < arc.dense.NumSteps(); ++k) {
    AskBudget();
    const double begin = std::max(arc.t_begin, arc.dense.StepBegin(k));
    const double end = std::min(arc.t_end, arc.dense.StepBegin(k) + arc.dense.StepLength(k));
    if (!(end - begin > kInstant * (arc.t_end - arc.t_begin))) continue;
    Vector middle = arc.x_begin;
    arc.dense.Evaluate(0.5 * (begin + end), middle.data());
    for (int i : Resting(functions, arc, begin, end)) {
      if (!RestingCorner(dynamics, functions, arc, i, middle).HasTwoSides()) continue;
      std::ostringstream message;
      message.precision(12);
      message << "from t = " << begin << " s to " << end << " s "
              << NameOf(dynamics.system(), functions, i)
              << ": the outcome has other slopes in runs on the one side of it than on the other";
      return {Outcome::kNotDifferentiable, message.str()};
    }
  }
  return {};
}

}  // namespace contact_flow
