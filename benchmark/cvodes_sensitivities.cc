// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/event_map.h"
#include "cvodes_solver.h"
#include "peer.h"

namespace contact_flow {
namespace benchmark {
namespace {

/// Forward sensitivities, staggered, in the error control; the saltation matrix at events is ours.
class CvodesSensitivities : public JacobianPeer {
 public:
  explicit CvodesSensitivities(const Scenario& scenario)
      : solver_(scenario, true),
        dynamics_(std::make_shared<ContactDynamics>(*scenario.system, scenario.u)) {}

  std::string name() const override { return "CVODES forward sensitivities"; }

  Matrix Run(double tolerance) override {
    solver_.Begin(tolerance);
    while (solver_.FlowToEvent()) {
      const int trigger = solver_.trigger();
      const Transition& transition = solver_.hybrid().Pass(solver_.t(), trigger, solver_.state());
      const Matrix saltation = EventMap(dynamics_, transition).Selection({trigger});
      for (int k = 0; k < kStates; ++k) {
        solver_.sensitivity(k) = (saltation * solver_.sensitivity(k)).eval();
      }
      solver_.Restart();
    }
    Matrix jacobian(kStates, kStates);
    for (int k = 0; k < kStates; ++k) jacobian.col(k) = solver_.sensitivity(k);
    return jacobian;
  }

 private:
  CvodesSolver solver_;
  std::shared_ptr<ContactDynamics> dynamics_;
};

}  // namespace

std::unique_ptr<JacobianPeer> MakeCvodesSensitivities(const Scenario& scenario) {
  return std::make_unique<CvodesSensitivities>(scenario);
}

}  // namespace benchmark
}  // namespace contact_flow
