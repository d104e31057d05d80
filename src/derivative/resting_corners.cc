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
#include "contact_flow/model/row_layout.h"
#include "held_tangents.h"

namespace contact_flow {
namespace {

/// A state or an input is moved by this part of 1 or itself, to see whether a function moves too;
/// then so far that the function is this far from its corner, beside max(1, |corner|).
constexpr double kProbe = 1e-6, kAside = 1e-7;
/// What is moved further than this part of 1 or itself does not move the function.
constexpr double kFarthest = 1e-3;
/// Entries of DF that differ by no more, beside their sizes, beside the largest of their column and
/// of all, are the same.
constexpr double kSameSlope = 1e-7, kNoCorner = 1e-9, kCancelled = 1e-13;

/// The two sides of a corner on which the motion rests.
class RestingCorner {
 public:
  RestingCorner(const ContactDynamics& dynamics, const CornerFunctions& functions, const Arc& arc,
                int function, const Vector& x, const RestingQuestion& question)
      : system_(dynamics.system()),
        variables_(dynamics.variables()),
        functions_(functions),
        arc_(arc),
        function_(function),
        x_(x),
        question_(question),
        value_(ValueAt(Vector::Zero(NumTangents()))) {}

  /// Whether what is asked for moves the run to two sides, on which DF is another one. An effort
  /// that nothing moves but parameters has one side only where none of these is a variable. At a
  /// knot the third derivative across it jumps, which DF has times the rate of the place: that is 0
  /// where nothing moves the place, whatever parameters do.
  bool HasTwoSides() const {
    Vector aside;
    if (!MovedBy(&aside)) return !IsKnot() && !variables_.parameters.empty();
    try {
      const Side one = SideOf(aside), other = SideOf(-aside);
      const Matrix admitted = Admitted();
      const Matrix jump = (one.slope - other.slope) * admitted;
      const Matrix sizes = Sizes(one, other, admitted);
      const auto m = variables_.inputs ? arc_.u.size() : 0;
      const Eigen::Index first = 2 * system_.dof(), rest = jump.cols() - first - m;
      if (!IsSmall(jump.leftCols(first), sizes.leftCols(first))) return true;
      if (!IsSmall(jump.rightCols(rest), sizes.rightCols(rest))) return true;
      const Matrix by_input = jump.middleCols(first, m), input_sizes = sizes.middleCols(first, m);
      if (IsSmall(by_input, input_sizes)) return false;
      const bool one_is_inner = value_ * MovedTo(aside) < 0;
      return !MovesInward(by_input, input_sizes) || !IsInner(one_is_inner ? one : other);
    } catch (const FrictionRefusal&) {
      return true;
    }
  }

 private:
  /// DF just beside the corner, without what smooth functions change by up to there, and its size.
  struct Side {
    Matrix slope, size;
  };
  Side SideOf(const Vector& aside) const {
    const Matrix near = JacobianAt(aside), far = JacobianAt(2 * aside);
    return {2 * near - far, near.cwiseAbs().cwiseMax(far.cwiseAbs())};
  }
  /// What entries of a difference along directions may be where there is none: beside those of
  /// free motion, too, which contacts may cancel.
  Matrix Sizes(const Side& one, const Side& other, const Matrix& directions) const {
    const Eigen::Index d = system_.dof();
    Matrix size = one.size.cwiseMax(other.size);
    const Matrix free = JacobianAt(Vector::Zero(NumTangents()), ContactMode()).topRows(d);
    const auto floors = [](const Matrix& entries) {
      const Eigen::RowVectorXd columns = kNoCorner * entries.colwise().maxCoeff();
      return Eigen::RowVectorXd(columns.array() + kCancelled * entries.maxCoeff());
    };
    const Eigen::RowVectorXd motion = floors(size.topRows(d).cwiseMax(free.cwiseAbs()));
    const Eigen::Index forces = size.rows() - d;
    const Eigen::RowVectorXd push =
        forces > 0 ? floors(size.bottomRows(forces)) : Eigen::RowVectorXd();
    size *= 2 * kSameSlope;
    size.topRows(d).rowwise() += motion;
    if (forces > 0) size.bottomRows(forces).rowwise() += push;
    return size * directions.cwiseAbs();
  }
  static bool IsSmall(const Matrix& entries, const Matrix& sizes) {
    return (entries.array().abs() <= sizes.array()).all();  // NaN is not
  }

  /// Whether all inputs that matter leave the function where it is or move it to the inner side of
  /// a limit, where the jump by the inputs is `jump`.
  bool MovesInward(const Matrix& jump, const Matrix& sizes) const {
    if (question_.inputs.cols() == 0 || IsKnot()) return false;
    for (Eigen::Index j = 0; j < question_.inputs.cols(); ++j) {
      const Vector input = question_.inputs.col(j);
      if (IsSmall(jump * input, sizes * input.cwiseAbs())) continue;
      Vector probe = Vector::Zero(NumTangents());
      probe.tail(input.size()) = kProbe / input.cwiseAbs().maxCoeff() * input;
      if (!(value_ * MovedTo(probe) < 0)) return false;
    }
    return true;
  }
  /// Whether DF at the state itself is that of this side.
  bool IsInner(const Side& side) const {
    const Matrix difference = JacobianAt(Vector::Zero(NumTangents())) - side.slope;
    const Matrix all = Matrix::Identity(difference.cols(), difference.cols());
    return IsSmall(difference, Sizes(side, side, all));
  }

  bool IsKnot() const { return function_ >= functions_.num_efforts(); }

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
  double MovedTo(const Vector& aside) const { return ValueAt(aside) - value_; }

  /// Of v̇, and of forces where they matter.
  Matrix JacobianAt(const Vector& aside) const { return JacobianAt(aside, arc_.mode); }
  Matrix JacobianAt(const Vector& aside, ContactMode mode) const {
    ContactDynamics dynamics(system_, InputAt(aside), variables_);
    dynamics.Differentiate(StateAt(aside), mode);
    const Matrix& by = dynamics.acceleration_jacobian();
    if (!question_.forces || dynamics.force_jacobian().rows() == 0) return by;
    Matrix both(by.rows() + dynamics.force_jacobian().rows(), by.cols());
    both << by, dynamics.force_jacobian();
    return both;
  }

  /// The directions that the mode admits, as columns [2d+k × 2d+k].
  Matrix Admitted() const {
    const Eigen::Index d = system_.dof();
    const ContactDynamics dynamics(system_, arc_.u, variables_);
    const Vector q = x_.head(system_.num_positions()), v = x_.tail(d);
    ConstraintTerms terms;
    system_.Constraints(q, v, &terms);
    const RowLayout layout(system_);
    std::vector<int> still;
    layout.AddTangential(arc_.mode.Sticking(), &still);
    const std::vector<int> closed = layout.Closed(arc_.mode - system_.compliant());
    const Eigen::Index size = 2 * d + dynamics.num_variables();
    return WithoutSpan(HeldTangents(dynamics, terms, closed, still, q, v),
                       Matrix::Identity(size, size));
  }

  /// What moves the function most, as a tangent that moves it a little; false if nothing does.
  bool MovedBy(Vector* aside) const {
    double best = 0;
    for (Eigen::Index j = 0; j < NumTangents(); ++j) {
      const Eigen::Index input = j - 2 * system_.dof();
      const double size = input < 0 ? 1 : std::max(1.0, std::abs(arc_.u(input)));
      const Vector probe = kProbe * size * Vector::Unit(NumTangents(), j);
      const double moved = std::max(std::abs(MovedTo(probe)), std::abs(MovedTo(-probe)));
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
  const RestingQuestion& question_;
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

Status CheckRestingCorners(const ContactDynamics& dynamics, const Arc& arc,
                           const RestingQuestion& question) {
  const CornerFunctions functions(dynamics.system());
  if (functions.Empty()) return {};
  for (std::size_t k = 0; k < arc.dense.NumSteps(); ++k) {
    AskBudget();
    const double begin = std::max(arc.t_begin, arc.dense.StepBegin(k));
    const double end = std::min(arc.t_end, arc.dense.StepBegin(k) + arc.dense.StepLength(k));
    if (!(end - begin > question.instant)) continue;
    Vector middle = arc.x_begin;
    arc.dense.Evaluate(0.5 * (begin + end), middle.data());
    for (int i : Resting(functions, arc, begin, end)) {
      const RestingCorner corner(dynamics, functions, arc, i, middle, question);
      if (!corner.HasTwoSides()) continue;
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
