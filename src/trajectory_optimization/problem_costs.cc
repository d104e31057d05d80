// SPDX-License-Identifier: BSD-3-Clause
// What a run of a problem costs.
#include <cmath>
#include <stdexcept>
#include <string>

#include "contact_flow/trajectory_optimization/problem.h"
#include "named_costs.h"

namespace contact_flow {
namespace {

void RequireWeight(const char* name, double weight) {
  if (weight >= 0 && std::isfinite(weight)) return;
  throw std::invalid_argument(std::string(name) + " must be finite and ≥ 0");
}

}  // namespace

void Unknowns::CheckNamedCosts() const {
  for (const PowerTerm& term : problem_.power) {
    const bool known = term.input >= 0 && term.input < inputs_ && term.velocity >= 0 &&
                       term.velocity < system_.dof();
    if (!known) throw std::invalid_argument("power has no such input or velocity");
    RequireWeight("the weight of power", term.weight);
  }
  const Eigen::Index size = problem_.impulse_weight.size();
  if (size != 0 && size != system_.num_constraints()) {
    throw std::invalid_argument("impulse_weight has " + std::to_string(size) + " entries: " +
                                std::to_string(system_.num_constraints()) + " are needed");
  }
  for (double weight : problem_.impulse_weight) {
    RequireWeight("impulse_weight", weight);
    if (weight == 0 || !system_.HasFriction()) continue;
    throw std::invalid_argument(
        "impulse_weight: contacts have friction, and their impulses are not differentiated");
  }
  CheckSlip();
}

void Unknowns::CheckSlip() const {
  const Vector& weights = problem_.slip_weight;
  if (weights.size() != 0 && weights.size() != system_.num_constraints()) {
    throw std::invalid_argument("slip_weight has " + std::to_string(weights.size()) + " entries: " +
                                std::to_string(system_.num_constraints()) + " are needed");
  }
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    RequireWeight("slip_weight", weights(i));
    const auto place = static_cast<std::size_t>(i);
    const bool slips = system_.HasFriction() && system_.friction()[place].dimension > 0;
    if (weights(i) == 0 || slips) continue;
    throw std::invalid_argument("slip_weight: '" + system_.description().constraints[place] +
                                "' has no friction, and no slip that is known");
  }
  if (!problem_.choose_parameters.empty() && HasSlipCost()) {
    throw std::invalid_argument(
        "slip_weight: a cost of slip is not differentiated by parameters (choose_parameters)");
  }
}

double Unknowns::Cost(const Vector& y, const Trajectory& run) const {
  double cost = Cost(y, States(run));
  if (HasRunningCost()) cost += RunningCostOf(problem_, system_, run);
  if (problem_.impulse_weight.size() > 0) cost += ImpulseOf(problem_, run);
  return cost;
}

Matrix Unknowns::States(const Trajectory& run) const {
  const std::size_t count = problem_.inputs.grid.size();
  Matrix states(system_.state_size(), static_cast<Eigen::Index>(count));
  Eigen::Index k = 0;
  for (std::size_t i = 0; i < run.transitions.size(); ++i) {
    if (run.transitions[i].changes_input) states.col(k++) = run.arcs[i].x_end;
  }
  if (k < states.cols()) states.rightCols<1>() = run.FinalState();
  return states;
}

Vector Unknowns::InputReference(std::size_t k) const {
  if (problem_.input_path.size() > 0) {
    return problem_.input_path.col(static_cast<Eigen::Index>(k));
  }
  if (problem_.input_reference.size() > 0) return problem_.input_reference;
  return Vector::Zero(inputs_);
}

Vector Unknowns::PathTarget(std::size_t k) const {
  if (problem_.path_reference.size() > 0) {
    return problem_.path_reference.col(static_cast<Eigen::Index>(k));
  }
  if (problem_.path_target.size() > 0) return problem_.path_target;
  return Vector::Zero(system_.num_positions());
}

double Unknowns::Cost(const Vector& y, const Matrix& states) const {
  const Eigen::Index nq = system_.num_positions();
  double cost = problem_.weight.dot((states.rightCols<1>() - problem_.target).cwiseAbs2());
  for (std::size_t k = 0; k < problem_.inputs.grid.size(); ++k) {
    const double length = Length(y, k);
    Vector u = InputAt(y, k) - InputReference(k);
    if (led_) {  // ∫ u² = h (mean² + (u₁ − u₀)²/12)
      const Vector turn = InputAt(y, k + 1) - InputAt(y, k);
      u += turn / 2;
      cost += length / 12 * problem_.effort.dot(turn.cwiseAbs2());
    }
    cost += length * problem_.effort.dot(u.cwiseAbs2()) + length * problem_.duration_weight;
    if (!HasPathCost()) continue;
    const Vector off = states.col(static_cast<Eigen::Index>(k)).head(nq) - PathTarget(k);
    cost += length * problem_.path_weight.dot(off.cwiseAbs2());
  }
  return cost;
}

}  // namespace contact_flow
