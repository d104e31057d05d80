// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <stdexcept>

#include "contact_flow/flow/simulate.h"
#include "peer.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kFirstStep = 4e-3;  // of the extrapolated differences

Matrix CentralDifferences(const Scenario& scenario, double tolerance, double step) {
  SimulateOptions options;
  options.dense = false;
  options.relative_tolerance = options.absolute_tolerance = tolerance;
  Matrix jacobian(kStates, kStates);
  Vector x = scenario.x;
  for (int k = 0; k < kStates; ++k) {
    for (int sign : {1, -1}) {
      x(k) = scenario.x(k) + sign * step;
      const Trajectory trajectory =
          Simulate(*scenario.system, x, scenario.u, scenario.duration, options);
      if (!trajectory.status.ok()) throw std::logic_error(trajectory.status.message);
      if (sign > 0) {
        jacobian.col(k) = trajectory.FinalState();
      } else {
        jacobian.col(k) -= trajectory.FinalState();
      }
    }
    x(k) = scenario.x(k);
  }
  return jacobian / (2 * step);
}

class DifferenceJacobian : public JacobianPeer {
 public:
  explicit DifferenceJacobian(const Scenario& scenario) : scenario_(scenario) {}
  std::string name() const override { return "central differences, 28 runs"; }
  Matrix Run(double tolerance) override {
    return CentralDifferences(scenario_, tolerance, std::cbrt(tolerance));
  }

 private:
  const Scenario& scenario_;
};

}  // namespace

std::unique_ptr<JacobianPeer> MakeDifferenceJacobian(const Scenario& scenario) {
  return std::make_unique<DifferenceJacobian>(scenario);
}

Matrix ExtrapolatedDifferences(const Scenario& scenario, double tolerance) {
  const Matrix D1 = CentralDifferences(scenario, tolerance, kFirstStep);
  const Matrix D2 = CentralDifferences(scenario, tolerance, kFirstStep / 2);
  const Matrix D4 = CentralDifferences(scenario, tolerance, kFirstStep / 4);
  const Matrix E1 = (4 * D2 - D1) / 3, E2 = (4 * D4 - D2) / 3;
  return (16 * E2 - E1) / 15;
}

}  // namespace benchmark
}  // namespace contact_flow
