// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <stdexcept>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "peer.h"

namespace contact_flow {
namespace benchmark {
namespace {

/// The run with its dense output, the propagators of the arcs and the event maps, as one matrix.
class ContactFlowJacobian : public JacobianPeer {
 public:
  explicit ContactFlowJacobian(const Scenario& scenario) : scenario_(scenario) {}

  std::string name() const override { return "contact_flow"; }

  Matrix Run(double tolerance) override {
    simulate_.relative_tolerance = simulate_.absolute_tolerance = tolerance;
    // The tangents keep their default tolerance, which meets the error asked for, unless
    // the run is tighter.
    differentiate_.tolerance = std::min(BDerivativeOptions().tolerance, 10 * tolerance);
    const Trajectory trajectory =
        Simulate(*scenario_.system, scenario_.x, scenario_.u, scenario_.duration, simulate_);
    const BDerivative derivative =
        DifferentiateOutcome(*scenario_.system, trajectory, differentiate_);
    if (!derivative.status.ok()) throw std::logic_error(derivative.status.message);
    Matrix jacobian = derivative.arcs.front();
    for (std::size_t k = 0; k < derivative.events.size(); ++k) {
      const EventMap& event = derivative.events[k];
      jacobian = derivative.arcs[k + 1] * (event.Selection(event.activated()) * jacobian);
    }
    return jacobian;
  }

 private:
  const Scenario& scenario_;
  SimulateOptions simulate_;
  BDerivativeOptions differentiate_;
};

}  // namespace

std::unique_ptr<JacobianPeer> MakeContactFlowJacobian(const Scenario& scenario) {
  return std::make_unique<ContactFlowJacobian>(scenario);
}

}  // namespace benchmark
}  // namespace contact_flow
