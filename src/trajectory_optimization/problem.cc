// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "led_problem.h"

namespace contact_flow {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void Require(bool fine, const std::string& what) {
  if (!fine) throw std::invalid_argument("trajectory problem: " + what);
}

/// `values` has `size` numbers, or none where that is allowed.
void CheckSize(const Vector& values, Eigen::Index size, bool may_be_empty, const char* name) {
  Require(values.size() == size || (may_be_empty && values.size() == 0),
          std::string(name) + " has " + std::to_string(values.size()) +
              " entries: " + std::to_string(size) + " are needed");
  Require(!values.hasNaN(), std::string(name) + " is not a number");
}

void CheckWeight(const Vector& values, const char* name) {
  for (double value : values) {
    Require(value >= 0 && std::isfinite(value), std::string(name) + " must be finite and ≥ 0");
  }
}

/// Indices below `size`, each once.
void CheckIndices(const std::vector<int>& indices, std::size_t size, const char* name) {
  std::vector<bool> taken(size, false);
  for (int i : indices) {
    const bool known = i >= 0 && static_cast<std::size_t>(i) < size;
    Require(known, std::string(name) + " has no such index");
    Require(!taken[static_cast<std::size_t>(i)], std::string(name) + " has an index twice");
    taken[static_cast<std::size_t>(i)] = true;
  }
}

void CheckBox(const Vector& lower, const Vector& upper, const char* name) {
  for (Eigen::Index i = 0; i < std::min(lower.size(), upper.size()); ++i) {
    Require(lower(i) <= upper(i),
            std::string("the lower bound of ") + name + " is above the upper");
  }
}

}  // namespace

std::string TrajectoryCondition::Describe(const SystemDescription& names,
                                          std::size_t instants) const {
  const auto place = static_cast<std::size_t>(index);
  if (kind == Kind::kTouchdown) {
    return "touchdown " + std::to_string(number + 1) + " of '" + names.constraints[place] + "'";
  }
  const std::size_t nq = names.coordinates.size();
  const std::string what =
      place < nq ? names.coordinates[place] : "d/dt " + names.velocities[place - nq];
  const bool end = number == static_cast<int>(instants);
  return what + (end ? " at the end" : " at instant " + std::to_string(number) + " of the grid");
}

Unknowns::Unknowns(const MechanicalSystem& system, const TrajectoryProblem& problem)
    : given_(system),
      led_(problem.linear_inputs ? Lead(system, problem) : nullptr),
      system_(led_ ? *led_->system : system),
      problem_(led_ ? led_->problem : problem),
      inputs_(system.num_inputs()) {
  CheckSizes();
  CheckConditions();
  CheckNamedCosts();
  const auto instants = static_cast<int>(problem.inputs.grid.size()) + (led_ ? 1 : 0);
  const int all = instants * inputs_;
  first_initial_ = problem.choose_inputs ? all : 0;
  first_parameter_ = first_initial_ + static_cast<int>(problem.choose_initial.size());
  first_duration_ = first_parameter_ + static_cast<int>(problem.choose_parameters.size());
  size_ = first_duration_ + static_cast<int>(problem.choose_durations.size());
  Require(size_ > 0, "nothing may be chosen");
  PlaceDurations();
  SetBounds();
}

void Unknowns::CheckSizes() const {
  const TrajectoryProblem& problem = problem_;
  const Eigen::Index nq = system_.num_positions(), m = inputs_, size = system_.state_size();
  CheckSize(problem.x, size, false, "x");
  Validate(given_, problem.inputs);
  CheckSize(problem.input_end, m, true, "input_end");
  Require(problem.input_end.allFinite(), "input_end is not finite");
  Require(led_ != nullptr || problem.input_end.size() == 0,
          "input_end is there although inputs are held (linear_inputs)");
  const std::size_t count = problem.inputs.grid.size();
  const double end = problem.inputs.grid.front() + problem.duration;
  Require(std::isfinite(problem.duration) && end > problem.inputs.grid.back(),
          "the horizon must lie behind the last instant of the grid");
  CheckSize(problem.effort, m, false, "effort");
  CheckSize(problem.input_reference, m, true, "input_reference");
  const Matrix& inputs = problem.input_path;
  Require(inputs.size() == 0 || (inputs.rows() == m && inputs.allFinite() &&
                                 inputs.cols() == static_cast<Eigen::Index>(count)),
          "input_path must be finite, with a column for each interval");
  CheckSize(problem.path_weight, nq, true, "path_weight");
  CheckSize(problem.path_target, nq, true, "path_target");
  const Matrix& reference = problem.path_reference;
  Require(reference.size() == 0 || (reference.rows() == nq && reference.allFinite() &&
                                    reference.cols() == static_cast<Eigen::Index>(count)),
          "path_reference must be finite, with a column for each interval");
  CheckSize(problem.weight, size, false, "weight");
  CheckSize(problem.target, size, false, "target");
  CheckWeight(problem.effort, "effort");
  CheckWeight(problem.path_weight, "path_weight");
  CheckWeight(problem.weight, "weight");
  CheckWeight(Vector::Constant(1, problem.duration_weight), "duration_weight");
  CheckSize(problem.lower, m, true, "lower");
  CheckSize(problem.upper, m, true, "upper");
  const auto chosen = static_cast<Eigen::Index>(problem.choose_initial.size());
  CheckSize(problem.initial_lower, chosen, true, "initial_lower");
  CheckSize(problem.initial_upper, chosen, true, "initial_upper");
  const auto parameters = static_cast<Eigen::Index>(problem.choose_parameters.size());
  CheckSize(problem.parameter_lower, parameters, true, "parameter_lower");
  CheckSize(problem.parameter_upper, parameters, true, "parameter_upper");
  const auto durations = static_cast<Eigen::Index>(problem.choose_durations.size());
  CheckSize(problem.duration_lower, durations, true, "duration_lower");
  CheckSize(problem.duration_upper, durations, true, "duration_upper");
  CheckBox(problem.lower, problem.upper, "an input");
  CheckBox(problem.initial_lower, problem.initial_upper, "the initial state");
  CheckBox(problem.parameter_lower, problem.parameter_upper, "a parameter");
  Require(problem.kink_interval >= 0 && std::isfinite(problem.kink_interval),
          "kink_interval must be finite and ≥ 0");
  CheckIndices(problem.choose_initial, 2 * static_cast<std::size_t>(system_.dof()),
               "choose_initial");
  CheckIndices(problem.choose_parameters, system_.description().parameters.size(),
               "choose_parameters");
  Require(parameters == 0 || static_cast<bool>(problem.factory),
          "choose_parameters needs a factory");
  CheckIndices(problem.choose_durations, count, "choose_durations");
  const auto& moved = problem.choose_durations;
  Require(!problem.keep_horizon ||
              std::count(moved.begin(), moved.end(), static_cast<int>(count) - 1) == 0,
          "where the horizon is kept the last interval cannot be chosen");
  if (chosen > 0) {
    Require(nq == system_.dof(), "the initial state cannot be chosen where quaternions are in it");
    const ContactMode mode = InitialMode(given_, WithoutClock(problem.x),
                                         problem.inputs.values.front(), problem.simulate);
    Require(mode.Empty(), "the initial state cannot be chosen where it is in contact");
  }
}

void Unknowns::CheckConditions() const {
  using Kind = TrajectoryCondition::Kind;
  Require(problem_.condition_tolerance > 0 && std::isfinite(problem_.condition_tolerance),
          "condition_tolerance must be finite and > 0");
  for (std::size_t i = 0; i < problem_.conditions.size(); ++i) {
    const TrajectoryCondition& condition = problem_.conditions[i];
    const std::string name = "conditions[" + std::to_string(i) + "]";
    const bool state = condition.kind == Kind::kState;
    const Eigen::Index size = state ? system_.state_size() : system_.num_constraints();
    Require(condition.index >= 0 && condition.index < size, name + " has no such index");
    const int count = static_cast<int>(problem_.inputs.grid.size());
    Require(state ? condition.number >= 1 && condition.number <= count : condition.number >= 0,
            name + " has no such number");
    // Bounds that are no numbers compare as false, too.
    Require(condition.lower <= condition.upper, name + ": the lower bound is above the upper");
    Require(std::isfinite(condition.lower) || std::isfinite(condition.upper),
            name + " has no finite bound");
  }
}

void Unknowns::PlaceDurations() {
  const std::size_t count = problem_.inputs.grid.size();
  length_rows_.assign(count, Eigen::RowVectorXd::Zero(size_));
  instant_rows_.assign(count + 1, Eigen::RowVectorXd::Zero(size_));
  for (std::size_t i = 0; i < problem_.choose_durations.size(); ++i) {
    length_rows_[static_cast<std::size_t>(problem_.choose_durations[i])](Duration(i)) = 1;
  }
  for (std::size_t k = 0; k < count; ++k) {
    if (problem_.keep_horizon && k + 1 == count) length_rows_[k] = -instant_rows_[k];
    instant_rows_[k + 1] = instant_rows_[k] + length_rows_[k];
  }
}

void Unknowns::SetBounds() {
  lower_ = Vector::Constant(size_, -kInfinity);
  upper_ = Vector::Constant(size_, kInfinity);
  for (int i = 0; i < first_initial_; ++i) {
    if (problem_.lower.size() > 0) lower_(i) = problem_.lower(i % inputs_);
    if (problem_.upper.size() > 0) upper_(i) = problem_.upper(i % inputs_);
  }
  const auto fill = [](const Vector& values, int first, Vector* bound) {
    if (values.size() > 0) bound->segment(first, values.size()) = values;
  };
  fill(problem_.initial_lower, first_initial_, &lower_);
  fill(problem_.initial_upper, first_initial_, &upper_);
  fill(problem_.parameter_lower, first_parameter_, &lower_);
  fill(problem_.parameter_upper, first_parameter_, &upper_);
  const auto durations = static_cast<Eigen::Index>(problem_.choose_durations.size());
  if (durations == 0) return;
  const Vector now = Start().tail(durations);
  lower_.tail(durations) = 0.1 * now;
  upper_.tail(durations) = 10 * now;
  if (problem_.keep_horizon) {
    const double last = Length(Start(), problem_.inputs.grid.size() - 1);
    const double share = 0.9 * last / static_cast<double>(durations);
    upper_.tail(durations) =
        upper_.tail(durations).cwiseMin(now + Vector::Constant(durations, share));
  }
  fill(problem_.duration_lower, first_duration_, &lower_);
  fill(problem_.duration_upper, first_duration_, &upper_);
  Require(lower_.tail(durations).minCoeff() > problem_.kink_interval,
          "duration_lower must be above kink_interval");
  CheckBox(lower_.tail(durations), upper_.tail(durations), "a duration");
}

Vector Unknowns::Start() const {
  Vector y = Vector::Zero(size_);
  for (int i = 0; i < first_initial_; ++i) {
    y(i) = FirstInput(static_cast<std::size_t>(i / inputs_))(i % inputs_);
  }
  for (std::size_t i = 0; i < problem_.choose_parameters.size(); ++i) {
    const auto place = static_cast<std::size_t>(problem_.choose_parameters[i]);
    y(Parameter(i)) = system_.description().parameters[place].value;
  }
  const std::vector<double>& grid = problem_.inputs.grid;
  for (std::size_t i = 0; i < problem_.choose_durations.size(); ++i) {
    const auto k = static_cast<std::size_t>(problem_.choose_durations[i]);
    const double end = k + 1 < grid.size() ? grid[k + 1] : grid.front() + problem_.duration;
    y(Duration(i)) = end - grid[k];
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

double Unknowns::Length(const Vector& y, std::size_t k) const {
  const auto& moved = problem_.choose_durations;
  const auto found = std::find(moved.begin(), moved.end(), static_cast<int>(k));
  if (found != moved.end()) return y(Duration(static_cast<std::size_t>(found - moved.begin())));
  const std::vector<double>& grid = problem_.inputs.grid;
  const double end = k + 1 < grid.size() ? grid[k + 1] : grid.front() + problem_.duration;
  if (k + 1 < grid.size() || !problem_.keep_horizon || moved.empty()) return end - grid[k];
  double rest = problem_.duration;
  for (std::size_t j = 0; j < k; ++j) rest -= Length(y, j);
  return rest;
}

double Unknowns::Horizon(const Vector& y) const {
  if (problem_.choose_durations.empty() || problem_.keep_horizon) return problem_.duration;
  double sum = 0;
  for (std::size_t k = 0; k < problem_.inputs.grid.size(); ++k) sum += Length(y, k);
  return sum;
}

std::vector<double> Unknowns::Instants(const Vector& y) const {
  std::vector<double> instants = Inputs(y).grid;
  instants.push_back(instants.front() + Horizon(y));
  instants.erase(instants.begin());
  return instants;
}

std::shared_ptr<const MechanicalSystem> Unknowns::SystemAt(const Vector& y) const {
  if (problem_.choose_parameters.empty()) return {std::shared_ptr<void>(), &system_};
  ParameterValues values;
  const std::vector<contact_flow::Parameter>& known = system_.description().parameters;
  for (const contact_flow::Parameter& parameter : known) values[parameter.name] = parameter.value;
  for (std::size_t i = 0; i < problem_.choose_parameters.size(); ++i) {
    values[known[static_cast<std::size_t>(problem_.choose_parameters[i])].name] = y(Parameter(i));
  }
  return problem_.factory(values);
}

Trajectory Unknowns::Run(const MechanicalSystem& system, const Vector& y,
                         double simultaneity_tolerance, bool dense) const {
  return RunBeyond(system, y, simultaneity_tolerance, dense, 0);
}

Trajectory Unknowns::RunBeyond(const MechanicalSystem& system, const Vector& y,
                               double simultaneity_tolerance, bool dense, double beyond) const {
  SimulateOptions options = problem_.simulate;
  options.simultaneity_tolerance = simultaneity_tolerance;
  options.dense = dense;
  if (!(Length(y, problem_.inputs.grid.size() - 1) > problem_.kink_interval)) {
    throw std::invalid_argument("the durations leave nothing to the last interval");
  }
  InputSchedule inputs = Inputs(y);
  const double horizon = Horizon(y);
  if (beyond > 0) {
    inputs.grid.push_back(inputs.grid.front() + horizon);
    inputs.values.push_back(Vector(inputs.values.back()));
  }
  return Simulate(system, InitialState(y), inputs, horizon + beyond, options);
}

Trajectory Unknowns::Run(const Vector& y, double simultaneity_tolerance, bool dense) const {
  return Run(*SystemAt(y), y, simultaneity_tolerance, dense);
}

}  // namespace contact_flow
