// SPDX-License-Identifier: BSD-3-Clause
// The inputs of a problem, that are held or led linearly.
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "led_problem.h"

namespace contact_flow {
namespace {

void RequireNumbers(Eigen::Index size, Eigen::Index needed, bool may_be_empty, const char* name) {
  if (size == needed || (may_be_empty && size == 0)) return;
  throw std::invalid_argument("trajectory problem: " + std::string(name) + " has " +
                              std::to_string(size) + " entries: " + std::to_string(needed) +
                              " are needed");
}

/// Numbers of positions, with that of the clock.
void LeadPositions(Eigen::Index nq, const char* name, Vector* values) {
  RequireNumbers(values->size(), nq, true, name);
  if (values->size() == 0) return;
  values->conservativeResize(nq + 1);
  (*values)(nq) = 0;
}

/// Numbers of states, with those of the clock.
void LeadStates(Eigen::Index nq, Eigen::Index d, const char* name, Vector* values) {
  RequireNumbers(values->size(), nq + d, false, name);
  Vector led(nq + d + 2);
  led << values->head(nq), 0, values->tail(d), 0;
  *values = led;
}

/// Index i < size of numbers of which those from `from` on have one more place before them; what is
/// no index becomes −1, which is refused.
int LeadIndex(int i, Eigen::Index from, Eigen::Index size) {
  if (i < 0 || i >= size) return -1;
  return i < from ? i : i + 1;
}

}  // namespace

std::shared_ptr<const Unknowns::Led> Unknowns::Lead(const MechanicalSystem& system,
                                                    const TrajectoryProblem& problem) {
  if (system.num_inputs() == 0) {
    throw std::invalid_argument("trajectory problem: linear_inputs of a system without inputs");
  }
  Validate(system, problem.inputs);
  const Eigen::Index nq = system.num_positions(), d = system.dof();
  auto led = std::make_shared<Led>();
  led->system = std::make_shared<LinearInputs>(
      std::shared_ptr<const MechanicalSystem>(std::shared_ptr<void>(), &system));
  led->problem = problem;
  TrajectoryProblem& its = led->problem;
  RequireNumbers(problem.x.size(), nq + d, false, "x");
  its.x = led->system->State(problem.x, problem.inputs.grid.front());
  LeadStates(nq, d, "weight", &its.weight);
  LeadStates(nq, d, "target", &its.target);
  LeadPositions(nq, "path_weight", &its.path_weight);
  LeadPositions(nq, "path_target", &its.path_target);
  if (its.path_reference.size() > 0) {
    RequireNumbers(its.path_reference.rows(), nq, false, "a column of path_reference");
    its.path_reference.conservativeResize(nq + 1, Eigen::NoChange);
    its.path_reference.bottomRows<1>().setZero();
  }
  for (int& i : its.choose_initial) i = LeadIndex(i, d, 2 * d);
  for (TrajectoryCondition& condition : its.conditions) {
    if (condition.kind != TrajectoryCondition::Kind::kState) continue;
    condition.index = LeadIndex(condition.index, nq, nq + d);
  }
  for (PowerTerm& term : its.power) {
    if (term.velocity >= d) term.velocity = -1;
  }
  if (problem.factory) {
    its.factory = [factory = problem.factory](const ParameterValues& values) {
      return std::make_unique<LinearInputs>(
          std::shared_ptr<const MechanicalSystem>(factory(values)));
    };
  }
  return led;
}

Vector Unknowns::InputAt(const Vector& y, std::size_t k) const {
  if (problem_.choose_inputs) return y.segment(Input(k, 0), inputs_);
  return FirstInput(k);
}

const Vector& Unknowns::FirstInput(std::size_t k) const {
  const std::vector<Vector>& values = problem_.inputs.values;
  if (k < values.size()) return values[k];
  return problem_.input_end.size() > 0 ? problem_.input_end : values.back();
}

InputSchedule Unknowns::Inputs(const Vector& y) const {
  InputSchedule schedule = problem_.inputs;
  if (!problem_.choose_durations.empty()) {
    for (std::size_t k = 1; k < schedule.grid.size(); ++k) {
      schedule.grid[k] = schedule.grid[k - 1] + Length(y, k - 1);
    }
  }
  for (std::size_t k = 0; k < schedule.grid.size(); ++k) {
    schedule.values[k] =
        led_ ? LinearInputs::Held(schedule.grid[k], Length(y, k), InputAt(y, k), InputAt(y, k + 1))
             : InputAt(y, k);
  }
  return schedule;
}

Matrix Unknowns::InputRows(const Vector& y, std::size_t k) const {
  Matrix rows = Matrix::Zero(system_.num_inputs(), size_);
  if (problem_.choose_inputs) {
    for (int j = 0; j < inputs_; ++j) rows(j, Input(k, j)) = 1;
  }
  if (!led_) return rows;
  const double h = Length(y, k);
  const Vector slope = (InputAt(y, k + 1) - InputAt(y, k)) / h;
  for (int j = 0; j < inputs_; ++j) {
    if (problem_.choose_inputs) {
      rows(inputs_ + j, Input(k, j)) = -1 / h;
      rows(inputs_ + j, Input(k + 1, j)) = 1 / h;
    }
    rows.row(inputs_ + j) -= slope(j) / h * length_rows_[k];
  }
  rows.row(2 * inputs_) = instant_rows_[k];
  return rows;
}

InputCones Unknowns::ConesOfInputs(const Vector& y) const {
  constexpr double kOnBound = 1e-12;  // beside max(1, |bound|)
  const auto on = [&](double bound, int i) {
    return std::abs(y(i) - bound) <= kOnBound * std::max(1.0, std::abs(bound));
  };
  InputCones cones;
  for (std::size_t k = 0; k < problem_.inputs.grid.size(); ++k) {
    const Matrix rows = InputRows(y, k);
    Matrix cone = Matrix::Zero(rows.rows(), 1 + 2 * size_);  // the first allows no change at all
    Eigen::Index count = 1;
    for (int i = 0; i < size_; ++i) {
      if (rows.col(i).isZero(0)) continue;
      if (!on(upper_(i), i)) cone.col(count++) = rows.col(i);
      if (!on(lower_(i), i)) cone.col(count++) = -rows.col(i);
    }
    cones.push_back(cone.leftCols(count));
  }
  cones.push_back(Matrix(cones.back()));  // beyond the horizon, where the last input goes on
  return cones;
}

Vector Unknowns::WithoutClock(const Vector& x) const {
  return led_ ? led_->system->BaseState(x) : x;
}

}  // namespace contact_flow
