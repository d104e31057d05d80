// SPDX-License-Identifier: BSD-3-Clause
// Sums of squares at the instants of the grid and of the conditions, to first order; what has the
// length of an interval as a factor, and that is an unknown, is the square of √h times a residual.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "model_builder.h"

namespace contact_flow {
namespace {

/// Velocities that change by less than this part of the largest change do not jump.
constexpr double kNoJump = 1e-9;

/// Adds Σ w_i r_i² with the derivative D of r.
void AddSquares(const Vector& weight, const Vector& error, const Matrix& D, PieceModel* model) {
  const Matrix weighted = weight.asDiagonal() * D;
  model->gradient += 2 * weighted.transpose() * error;
  model->hessian.noalias() += 2 * weighted.transpose() * D;
}

}  // namespace

void AddSquare(double weight, double r, const Eigen::RowVectorXd& row, PieceModel* model) {
  std::vector<Eigen::Index> places;
  for (Eigen::Index i = 0; i < row.size(); ++i) {
    if (row(i) != 0) places.push_back(i);
  }
  for (Eigen::Index j : places) {
    model->gradient(j) += 2 * weight * r * row(j);
    for (Eigen::Index i : places) model->hessian(i, j) += 2 * weight * row(i) * row(j);
  }
}

/// h_k r_j times the square of u − ū on the interval; where inputs are led linearly of its mean,
/// and h_k r_j/12 times that of u₁ − u₀.
void ModelBuilder::AddEffort(PieceModel* model) const {
  for (std::size_t k = 0; k < problem_.inputs.grid.size(); ++k) {
    const double length = unknowns_.Length(y_, k);
    const Eigen::RowVectorXd& by_length = unknowns_.LengthRow(k);
    const bool moves = moves_ && !by_length.isZero(0);
    if (moves) AddSquare(problem_.duration_weight * length, 1, 0.5 / length * by_length, model);
    const Vector begin = unknowns_.InputAt(y_, k), reference = unknowns_.InputReference(k);
    Vector end = begin;
    if (problem_.linear_inputs) end = unknowns_.InputAt(y_, k + 1);
    for (Eigen::Index j = 0; j < problem_.effort.size(); ++j) {
      const double weight = length * problem_.effort(j);
      const int first = unknowns_.Input(k, static_cast<int>(j));
      const int last = problem_.linear_inputs ? unknowns_.Input(k + 1, static_cast<int>(j)) : first;
      const auto add = [&](double part, double r, double by_first, double by_last) {
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(unknowns_.size());
        if (first >= 0) {
          row(first) += by_first;
          row(last) += by_last;
        }
        if (moves) row += (0.5 * r / length) * by_length;
        AddSquare(part * weight, r, row, model);
        // √h r has no curvature along δr/r = −δh/(2h): as much as along δh is added.
        if (!moves) return;
        model->hessian +=
            (0.5 * part * weight * r * r / length / length) * by_length.transpose() * by_length;
      };
      add(1, (begin(j) + end(j)) / 2 - reference(j), 0.5, 0.5);
      if (problem_.linear_inputs) add(1.0 / 12, end(j) - begin(j), -1, 1);
    }
  }
}

/// The derivative of x = (q, v) by the unknowns.
Matrix ModelBuilder::StateRates(const Vector& x, const Matrix& W) const {
  const int d = system_.dof(), nq = system_.num_positions();
  Matrix rates(nq, d);
  Vector rate(nq);
  for (int j = 0; j < d; ++j) {
    const Vector unit = Vector::Unit(d, j);
    system_.space().Rate(x.data(), unit.data(), rate.data());
    rates.col(j) = rate;
  }
  Matrix D(nq + d, W.cols());
  D << rates * W.topRows(d), W.middleRows(d, d);
  return D;
}

/// Whether the state at t_{k+1} may cost anything, or is to hold a condition.
bool ModelBuilder::Asks(std::size_t k) const {
  return k + 1 == problem_.inputs.grid.size() || unknowns_.HasPathCost() ||
         std::any_of(problem_.conditions.begin(), problem_.conditions.end(),
                     [&](const TrajectoryCondition& condition) {
                       return condition.kind == TrajectoryCondition::Kind::kState &&
                              condition.number == static_cast<int>(k) + 1;
                     });
}

/// The state at t_{k+1}, with the tangents of its left limit there.
void ModelBuilder::AddState(std::size_t k, const Matrix& W, PieceModel* model) const {
  const bool end = k + 1 == problem_.inputs.grid.size();
  const int number = static_cast<int>(k) + 1;
  if (!end && !Asks(k)) return;
  const Vector x = states_.col(static_cast<Eigen::Index>(k));
  const Matrix D = StateRates(x, W);
  const Eigen::Index nq = system_.num_positions();
  if (end) AddSquares(problem_.weight, x - problem_.target, D, model);
  if (unknowns_.HasPathCost()) {
    const double length = unknowns_.Length(y_, k);
    const Vector error = x.head(nq) - unknowns_.PathTarget(k);
    Matrix rows = D.topRows(nq);
    if (moves_) rows += (0.5 / length) * error * unknowns_.LengthRow(k);
    AddSquares(length * problem_.path_weight, error, rows, model);
  }
  for (std::size_t i = 0; i < problem_.conditions.size(); ++i) {
    const TrajectoryCondition& condition = problem_.conditions[i];
    if (condition.kind != TrajectoryCondition::Kind::kState || condition.number != number) continue;
    AddCondition(i, D.row(condition.index), model);
  }
}

void ModelBuilder::AddCondition(std::size_t i, const Eigen::RowVectorXd& row,
                                PieceModel* model) const {
  const auto place = static_cast<Eigen::Index>(i);
  model->conditions.row(place) = row;
  if (multipliers_.rho.size() == 0) return;
  const double r = multipliers_.Residual(problem_.conditions[i], place, values_(place));
  if (r != 0) AddSquare(0.5 * multipliers_.rho(place), r, row, model);
}

bool ModelBuilder::AddTouchdowns(PieceModel* model, Status* status) const {
  for (std::size_t i = 0; i < problem_.conditions.size(); ++i) {
    const TrajectoryCondition& condition = problem_.conditions[i];
    if (condition.kind != TrajectoryCondition::Kind::kTouchdown) continue;
    bool known = false;
    for (const EventTime& event : events_) {
      if (!(event.name == EventName{condition.index, condition.number})) continue;
      known = true;
      AddCondition(i, event.row, model);
    }
    if (known) continue;
    *status = {Outcome::kNotDifferentiable,
               condition.Describe(system_.description(), problem_.inputs.grid.size()) +
                   " has no derivative of its own: several contacts with friction land at once"};
    return false;
  }
  return true;
}

/// What asks for a velocity at t_{k+1} that this event makes jump, or, at T, for an impulse that
/// comes or not; empty where nothing does.
std::string ModelBuilder::AskedJump(std::size_t k, const EventMap& event) const {
  const Transition& transition = event.transition();
  const int nq = system_.num_positions(), number = static_cast<int>(k) + 1;
  const SystemDescription& names = system_.description();
  const Vector jump = (transition.x_plus - transition.x_minus).tail(system_.dof()).cwiseAbs();
  // What happens between several impacts the whole of their jumps does not tell.
  const bool several = transition.activated.Size() > 1;
  const auto jumps = [&](int i) {
    return i >= nq && (several || jump(i - nq) > kNoJump * jump.maxCoeff());
  };
  for (const TrajectoryCondition& condition : problem_.conditions) {
    const bool state = condition.kind == TrajectoryCondition::Kind::kState;
    if (!state || condition.number != number || !jumps(condition.index)) continue;
    return "a condition on a velocity, " + condition.Describe(names, problem_.inputs.grid.size()) +
           ",";
  }
  if (number != static_cast<int>(problem_.inputs.grid.size())) return "";
  for (int i = nq; i < problem_.weight.size(); ++i) {
    if (problem_.weight(i) == 0 || !jumps(i)) continue;
    TrajectoryCondition asked;
    asked.index = i;
    asked.number = number;
    return "the cost of " + asked.Describe(names, problem_.inputs.grid.size());
  }
  for (int i : transition.activated) {
    if (problem_.impulse_weight.size() == 0 || problem_.impulse_weight(i) == 0) continue;
    return "the cost of impulses of '" + names.constraints[static_cast<std::size_t>(i)] + "'";
  }
  return "";
}

/// Contacts whose impacts, by M⁻¹ Daᵀ at T, change a velocity that is asked for there, or
/// cost by their impulses; all of them where a cost on the way is not differentiated there.
ConstraintSet ModelBuilder::JumpingAtEnd() const {
  const int nq = system_.num_positions(), d = system_.dof();
  const int count = static_cast<int>(problem_.inputs.grid.size());
  std::vector<bool> asked(static_cast<std::size_t>(d), false);
  for (int i = 0; i < d && problem_.weight.size() > 0; ++i) {
    asked[static_cast<std::size_t>(i)] = problem_.weight(nq + i) > 0;
  }
  for (const TrajectoryCondition& condition : problem_.conditions) {
    const bool at_end =
        condition.kind == TrajectoryCondition::Kind::kState && condition.number == count;
    if (at_end && condition.index >= nq) {
      asked[static_cast<std::size_t>(condition.index - nq)] = true;
    }
  }
  const Vector& x = run_.FinalState();
  const InverseInertia inertia(system_, x.head(nq), x.tail(d));
  ConstraintSet jumping;
  for (int i = 0; i < system_.num_constraints(); ++i) {
    const bool impulse = problem_.impulse_weight.size() > 0 && problem_.impulse_weight(i) > 0;
    bool jumps = impulse || unknowns_.HasRunningCost();
    const Vector reach = inertia * Matrix(inertia.terms().jacobian.row(i).transpose());
    for (int j = 0; j < d && !system_.compliant().Contains(i); ++j) {
      const bool is = std::abs(reach(j)) > kNoJump * reach.cwiseAbs().maxCoeff();
      jumps = jumps || (is && asked[static_cast<std::size_t>(j)]);
    }
    if (jumps) jumping.Insert(i);
  }
  return jumping;
}

}  // namespace contact_flow
