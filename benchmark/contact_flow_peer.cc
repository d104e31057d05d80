// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>

#include "contact_flow/flow/simulate.h"
#include "peer.h"

namespace contact_flow {
namespace benchmark {
namespace {

/// The public call, with all it does: validation, the initial mode, margins, allocation.
class ContactFlow : public Peer {
 public:
  explicit ContactFlow(const Scenario& scenario) : scenario_(scenario) { options_.dense = false; }

  std::string name() const override { return "contact_flow DOP853"; }

  RunResult Run(double tolerance) override {
    options_.relative_tolerance = options_.absolute_tolerance = tolerance;
    options_.method = IntegrationMethod::kExplicit;  // as its peers
    const Trajectory trajectory =
        Simulate(*scenario_.system, scenario_.x, scenario_.u, scenario_.duration, options_);
    if (!trajectory.status.ok()) throw std::logic_error(trajectory.status.message);
    return {trajectory.FinalState(), trajectory.statistics.field_evaluations};
  }

 private:
  const Scenario& scenario_;
  SimulateOptions options_;
};

}  // namespace

std::unique_ptr<Peer> MakeContactFlow(const Scenario& scenario) {
  return std::make_unique<ContactFlow>(scenario);
}

}  // namespace benchmark
}  // namespace contact_flow
