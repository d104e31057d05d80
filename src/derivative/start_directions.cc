// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/start_directions.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/driven.h"
#include "contact_flow/model/row_layout.h"

namespace contact_flow {
namespace {

/// What is left of a direction below this part of its largest entry is rounding.
constexpr double kKept = 1e-9;
/// Rows that a direction should keep are left by it beyond this part of their terms.
constexpr double kApart = 1e-8;

}  // namespace

StartDirections::StartDirections(int size) : states_(size), rows_(0, size) {}

StartDirections::StartDirections(const MechanicalSystem& system, const VectorRef& x,
                                 ContactMode mode, const StartCone& cone,
                                 const Variables& variables)
    : states_(2 * system.dof()),
      cone_(cone),
      mode_(mode.ToString(system.description().constraints)),
      names_(system.description().constraints) {
  const int d = system.dof(), nq = system.num_positions(), n = system.num_constraints();
  const RowLayout layout(system);
  const std::vector<int> gaps = layout.Closed(mode - system.compliant());
  std::vector<int> rates = gaps;
  for (int i = 0; i < n && system.HasFriction(); ++i) {
    if (!mode.Contains(i) || !std::isinf(system.friction()[i].coefficient)) continue;
    layout.AddTangential(i, &rates);
  }
  if (gaps.empty()) rates.clear();
  rows_ = Matrix::Zero(static_cast<Eigen::Index>(gaps.size() + rates.size()),
                       2 * d + variables.Size(system));
  if (gaps.empty()) return;
  const auto k = static_cast<Eigen::Index>(gaps.size());
  const auto parameters = static_cast<Eigen::Index>(variables.parameters.size());
  // Rows of D(a_J, Da_J v, T v of no slip): [A 0 0 ∂a/∂p; D_q(A v) A 0 ∂(A v)/∂p].
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  const Vector no_impulse = Vector::Zero(terms.gap.size());
  ResidualJacobian residual;
  system.DifferentiateImpact(x.head(nq), Vector::Zero(d), no_impulse, x.tail(d), &residual);
  ParameterJacobian by_parameter;
  if (parameters > 0) {
    system.DifferentiateImpactByParameters(x.head(nq), Vector::Zero(d), no_impulse, x.tail(d),
                                           variables.parameters, &by_parameter);
  }
  for (Eigen::Index row = 0; row < rows_.rows(); ++row) {
    const bool rate = row >= k;
    const int i = rate ? rates[row - k] : gaps[row];
    rows_.row(row).segment(rate ? d : 0, d) = terms.jacobian.row(i);
    if (rate) rows_.row(row).head(d) = residual.constraint_q.row(i);
    if (parameters == 0) continue;
    const Matrix& by = rate ? by_parameter.constraint : by_parameter.gap;
    rows_.row(row).tail(parameters) = by.row(i);
  }
  // No start changes what is driven, the rate of a clock.
  Matrix moved = rows_.leftCols(states_);
  const InverseInertia inertia(system, x.head(nq), x.tail(d));
  for (int j : Driven(inertia.mass())) moved.col(d + j).setZero();
  solver_.compute(moved);
}

Vector StartDirections::Project(const VectorRef& w) const {
  Vector projected = w;
  if (KeepsAll()) return projected;
  const Eigen::Index cols = std::min(w.size(), rows_.cols());
  projected.head(states_) -= solver_.solve(rows_.leftCols(cols) * w.head(cols));
  const double scale = w.lpNorm<Eigen::Infinity>();
  if (projected.lpNorm<Eigen::Infinity>() <= kKept * scale) projected.setZero();
  return projected;
}

Matrix StartDirections::Projector() const {
  Matrix projector = Matrix::Identity(rows_.cols(), rows_.cols());
  if (!KeepsAll()) projector.topRows(states_) -= solver_.solve(rows_);
  return projector;
}

/// Whether no change of the state would keep J, as rows of it depend on each other and are at odds
/// along w, which Project has left as it is.
bool StartDirections::MovesApart(const Vector& w) const {
  if (KeepsAll()) return false;
  const Vector left = rows_ * w;
  const double size = kApart * w.lpNorm<Eigen::Infinity>();
  for (Eigen::Index r = 0; r < left.size(); ++r) {
    if (std::abs(left(r)) > size * rows_.row(r).lpNorm<1>()) return true;
  }
  return false;
}

StartDirections::Judgement StartDirections::Judge(const VectorRef& w) const {
  using Kind = Judgement::Kind;
  if (!w.allFinite()) {
    throw std::invalid_argument("the direction has a number that is not finite");
  }
  const double change = (Project(w) - w).lpNorm<Eigen::Infinity>();
  if (change > kKept * w.lpNorm<Eigen::Infinity>()) return {Kind::kLeavesMode, -1};
  Vector complete = Vector::Zero(rows_.cols());
  complete.head(w.size()) = w;
  if (MovesApart(complete)) return {Kind::kLeavesMode, -1};
  const int out = cone_.Leaves(complete);
  if (out < 0) return {};
  return {cone_.Reverses(out) ? Kind::kAgainstSlip : Kind::kLeavesDomain, out};
}

std::string StartDirections::Sentence(const Judgement& judgement) const {
  const auto name = [&] {
    return "'" + names_[static_cast<std::size_t>(judgement.constraint)] + "'";
  };
  switch (judgement.kind) {
    case Judgement::Kind::kAdmitted:
      return "is admitted";
    case Judgement::Kind::kLeavesMode:
      return "leaves the contact mode " + mode_ + " of the start";
    case Judgement::Kind::kLeavesDomain:
      if (cone_.IsSwitch(judgement.constraint)) {
        return "moves the clock over " + name() +
               ", on which the run begins or ends, to the side that it is not on";
      }
      return "leads through the constraint " + name() + ", which the start touches";
    case Judgement::Kind::kAgainstSlip:
      return "moves the contact " + name() +
             ", which begins to slip at the start, against that slip: how it is reversed is not "
             "followed";
  }
  return "";
}

}  // namespace contact_flow
