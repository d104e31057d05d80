// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/problem.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace contact_flow {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void Require(bool fine, const std::string& what) {
  if (!fine) throw std::invalid_argument("trajectory problem: " + what);
}

/// `values` has `size` numbers, or none where that is allowed.
void CheckSize(const Vector& values, Eigen::Index size, bool may_be_empty, const char* name) {
  Require(values.size() == size || (may_be_empty && values.size() == 0),
          std::string(name) + " has " + std::to_string(values.size()) + " entries: " +
              std::to_string(size) + " are needed");
  Require(!values.hasNaN(), std::string(name) + " is not a number");
}

void CheckWeight(const Vector& values, const char* name) {
  for (double value : values) {
    Require(value >= 0 && std::isfinite(value), std::string(name) + " must be finite and ≥ 0");
  }
}

void CheckBox(const Vector& lower, const Vector& upper, const char* name) {
  for (Eigen::Index i = 0; i < std::min(lower.size(), upper.size()); ++i) {
    Require(lower(i) <= upper(i),
            std::string("the lower bound of ") + name + " is above the upper");
  }
}

}  // namespace

Unknowns::Unknowns(const MechanicalSystem& system, const TrajectoryProblem& problem)
    : system_(system), problem_(problem), inputs_(system.num_inputs()) {
  const Eigen::Index nq = system.num_positions(), m = inputs_, size = system.state_size();
  CheckSize(problem.x, size, false, "x");
  Validate(system, problem.inputs);
  const double end = problem.inputs.grid.front() + problem.duration;
  Require(std::isfinite(problem.duration) && end > problem.inputs.grid.back(),
          "the horizon must lie behind the last instant of the grid");
  CheckSize(problem.effort, m, false, "effort");
  CheckSize(problem.input_reference, m, true, "input_reference");
  CheckSize(problem.path_weight, nq, true, "path_weight");
  CheckSize(problem.path_target, nq, true, "path_target");
  CheckSize(problem.weight, size, false, "weight");
  CheckSize(problem.target, size, false, "target");
  CheckWeight(problem.effort, "effort");
  CheckWeight(problem.path_weight, "path_weight");
  CheckWeight(problem.weight, "weight");
  CheckSize(problem.lower, m, true, "lower");
  CheckSize(problem.upper, m, true, "upper");
  const auto chosen = static_cast<Eigen::Index>(problem.choose_initial.size());
  CheckSize(problem.initial_lower, chosen, true, "initial_lower");
  CheckSize(problem.initial_upper, chosen, true, "initial_upper");
  CheckBox(problem.lower, problem.upper, "an input");
  CheckBox(problem.initial_lower, problem.initial_upper, "the initial state");
  Require(problem.kink_interval >= 0 && std::isfinite(problem.kink_interval),
          "kink_interval must be finite and ≥ 0");
  for (int i : problem.choose_initial) {
    Require(i >= 0 && i < 2 * system.dof(), "choose_initial has no such index");
  }
  if (chosen > 0) {
    Require(nq == system.dof(), "the initial state cannot be chosen where quaternions are in it");
    const ContactMode mode =
        InitialMode(system, problem.x, problem.inputs.values.front(), problem.simulate);
    Require(mode.Empty(), "the initial state cannot be chosen where it is in contact");
  }
  const int all = static_cast<int>(problem.inputs.grid.size()) * inputs_;
  first_initial_ = problem.choose_inputs ? all : 0;
  size_ = first_initial_ + static_cast<int>(chosen);
  Require(size_ > 0, "nothing may be chosen");
  lower_ = Vector::Constant(size_, -kInfinity);
  upper_ = Vector::Constant(size_, kInfinity);
  for (int i = 0; i < first_initial_; ++i) {
    if (problem.lower.size() > 0) lower_(i) = problem.lower(i % inputs_);
    if (problem.upper.size() > 0) upper_(i) = problem.upper(i % inputs_);
  }
  if (problem.initial_lower.size() > 0) lower_.tail(chosen) = problem.initial_lower;
  if (problem.initial_upper.size() > 0) upper_.tail(chosen) = problem.initial_upper;
}

Vector Unknowns::Start() const {
  Vector y = Vector::Zero(size_);
  for (int i = 0; i < first_initial_; ++i) {
    y(i) = problem_.inputs.values[static_cast<std::size_t>(i / inputs_)](i % inputs_);
  }
  return y.cwiseMax(lower_).cwiseMin(upper_);
}

Vector Unknowns::InitialState(const Vector& y) const {
  if (problem_.choose_initial.empty()) return problem_.x;
  Vector change = Vector::Zero(2 * system_.dof());
  for (std::size_t i = 0; i < problem_.choose_initial.size(); ++i) {
    change(problem_.choose_initial[i]) += y(Initial(i));
  }
  return system_.Perturb(problem_.x, change);
}

InputSchedule Unknowns::Inputs(const Vector& y) const {
  InputSchedule schedule = problem_.inputs;
  for (int i = 0; i < first_initial_; ++i) {
    schedule.values[static_cast<std::size_t>(i / inputs_)](i % inputs_) = y(i);
  }
  return schedule;
}

Trajectory Unknowns::Run(const Vector& y, double simultaneity_tolerance, bool dense) const {
  SimulateOptions options = problem_.simulate;
  options.simultaneity_tolerance = simultaneity_tolerance;
  options.dense = dense;
  return Simulate(system_, InitialState(y), Inputs(y), problem_.duration, options);
}

double Unknowns::Length(std::size_t k) const {
  const std::vector<double>& grid = problem_.inputs.grid;
  const double end = k + 1 < grid.size() ? grid[k + 1] : grid.front() + problem_.duration;
  return end - grid[k];
}

Matrix Unknowns::Positions(const Trajectory& run) const {
  const std::size_t count = problem_.inputs.grid.size();
  Matrix positions(system_.num_positions(), static_cast<Eigen::Index>(count));
  Eigen::Index k = 0;
  for (std::size_t i = 0; i < run.transitions.size(); ++i) {
    if (!run.transitions[i].changes_input) continue;
    positions.col(k++) = run.arcs[i].x_end.head(system_.num_positions());
  }
  positions.col(static_cast<Eigen::Index>(count) - 1) =
      run.FinalState().head(system_.num_positions());
  return positions;
}

double Unknowns::Cost(const Vector& y, const Matrix& positions, const Vector& end) const {
  double cost = problem_.weight.dot((end - problem_.target).cwiseAbs2());
  const InputSchedule schedule = Inputs(y);
  for (std::size_t k = 0; k < schedule.grid.size(); ++k) {
    Vector u = schedule.values[k];
    if (problem_.input_reference.size() > 0) u -= problem_.input_reference;
    cost += Length(k) * problem_.effort.dot(u.cwiseAbs2());
    if (!HasPathCost()) continue;
    Vector q = positions.col(static_cast<Eigen::Index>(k));
    if (problem_.path_target.size() > 0) q -= problem_.path_target;
    cost += Length(k) * problem_.path_weight.dot(q.cwiseAbs2());
  }
  return cost;
}

}  // namespace contact_flow
