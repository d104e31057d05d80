// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "scenario.h"

namespace contact_flow {
namespace benchmark {

/// The outcome of one run.
struct RunResult {
  Eigen::Matrix<double, kStates, 1> state;
  long right_hand_sides = 0;
};

/// One way to flow a scenario to its horizon. Memory is taken by the constructor where the method
/// allows it. The scenario must outlive the peer.
class Peer {
 public:
  virtual ~Peer() = default;
  virtual std::string name() const = 0;
  /// Relative and absolute tolerance of each step.
  virtual RunResult Run(double tolerance) = 0;
};

/// One way to the 14×14 Jacobian of a scenario's outcome.
class JacobianPeer {
 public:
  virtual ~JacobianPeer() = default;
  virtual std::string name() const = 0;
  virtual Matrix Run(double tolerance) = 0;
};

std::unique_ptr<Peer> MakeContactFlow(const Scenario& scenario);
std::unique_ptr<Peer> MakeOdeintFehlberg78(const Scenario& scenario);
std::unique_ptr<Peer> MakeOdeintDopri5(const Scenario& scenario);
/// Null when the benchmark is built without SUNDIALS.
std::unique_ptr<Peer> MakeCvodesAdams(const Scenario& scenario);

std::unique_ptr<JacobianPeer> MakeContactFlowJacobian(const Scenario& scenario);
/// Central differences of our plain runs, with steps of tolerance^{1/3}.
std::unique_ptr<JacobianPeer> MakeDifferenceJacobian(const Scenario& scenario);
/// Null when the benchmark is built without SUNDIALS.
std::unique_ptr<JacobianPeer> MakeCvodesSensitivities(const Scenario& scenario);

/// Differences extrapolated from three steps (Richardson), accurate but slow: a check.
Matrix ExtrapolatedDifferences(const Scenario& scenario, double tolerance);

}  // namespace benchmark
}  // namespace contact_flow
