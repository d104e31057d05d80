// SPDX-License-Identifier: BSD-3-Clause
#include "cvodes_solver.h"
#include "peer.h"

namespace contact_flow {
namespace benchmark {
namespace {

class CvodesAdams : public Peer {
 public:
  explicit CvodesAdams(const Scenario& scenario) : solver_(scenario, false) {}

  std::string name() const override { return "CVODES Adams"; }

  RunResult Run(double tolerance) override {
    solver_.Begin(tolerance);
    while (solver_.FlowToEvent()) {
      solver_.hybrid().Pass(solver_.t(), solver_.trigger(), solver_.state());
      solver_.Restart();
    }
    return {Eigen::Map<const Eigen::Matrix<double, kStates, 1>>(solver_.state()),
            solver_.hybrid().right_hand_sides()};
  }

 private:
  CvodesSolver solver_;
};

}  // namespace

std::unique_ptr<Peer> MakeCvodesAdams(const Scenario& scenario) {
  return std::make_unique<CvodesAdams>(scenario);
}

}  // namespace benchmark
}  // namespace contact_flow
