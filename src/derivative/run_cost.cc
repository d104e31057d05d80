// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/run_cost.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace contact_flow {
namespace {

/// `values` with its size, zeros where it is empty.
Vector Complete(const Vector& values, Eigen::Index size, bool is_weight, const char* name) {
  if (values.size() == 0) return Vector::Zero(size);
  if (values.size() != size) {
    throw std::invalid_argument("cost: " + std::string(name) + " has " +
                                std::to_string(values.size()) +
                                " entries: " + std::to_string(size) + " or none are needed");
  }
  for (double value : values) {
    if (!std::isfinite(value)) {
      throw std::invalid_argument("cost: " + std::string(name) + " is not finite");
    }
    if (is_weight && value < 0) {
      throw std::invalid_argument("cost: " + std::string(name) + " must be ≥ 0");
    }
  }
  return values;
}

}  // namespace

RunCost QuadraticCost::Make(const MechanicalSystem& system) const {
  const Eigen::Index size = system.state_size(), m = system.num_inputs();
  const Vector w = Complete(weight, size, true, "weight");
  const Vector g = Complete(target, size, false, "target");
  const Vector s = Complete(state_weight, size, true, "state_weight");
  const Vector p = Complete(state_reference, size, false, "state_reference");
  const Vector r = Complete(input_weight, m, true, "input_weight");
  const Vector o = Complete(input_reference, m, false, "input_reference");
  RunCost cost;
  if (!w.isZero(0)) {
    cost.terminal = [w, g](const Vector& x, Vector* by_state) {
      *by_state = w.cwiseProduct(x - g);
      return 0.5 * by_state->dot(x - g);
    };
  }
  if (!s.isZero(0) || !r.isZero(0)) {
    cost.running = [s, p, r, o](double, const Vector& x, const Vector& u, CostRate* rate) {
      rate->by_state = s.cwiseProduct(x - p);
      rate->by_input = r.cwiseProduct(u - o);
      rate->value = 0.5 * (rate->by_state.dot(x - p) + rate->by_input.dot(u - o));
      rate->by_time = 0;
    };
  }
  return cost;
}

Vector ByTangents(const MechanicalSystem& system, const Vector& x, const Vector& by_state) {
  const int d = system.dof(), nq = system.num_positions();
  Vector gradient(2 * d);
  gradient.tail(d) = by_state.tail(d);
  if (system.space().IsFlat()) {
    gradient.head(d) = by_state.head(d);
    return gradient;
  }
  Vector unit = Vector::Zero(d), rate(nq);
  for (int k = 0; k < d; ++k) {
    unit(k) = 1;
    system.space().Rate(x.data(), unit.data(), rate.data());
    gradient(k) = by_state.head(nq).dot(rate);
    unit(k) = 0;
  }
  return gradient;
}

}  // namespace contact_flow
