// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "peer.h"
#include "sections.h"
#include "timing.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kTolerance = 1e-10;
constexpr double kReferenceTolerance = 1e-13, kDifferenceTolerance = 1e-12;
constexpr double kLargestError = 1e-8;

double Difference(const Matrix& a, const Matrix& b) { return (a - b).cwiseAbs().maxCoeff(); }

Matrix Reference(const Scenario& scenario, JacobianPeer* ours) {
  const Matrix tight = ours->Run(kReferenceTolerance);
  std::printf("  reference: ours at %.0e, differs from extrapolated differences at %.0e by %.1e",
              kReferenceTolerance, kDifferenceTolerance,
              Difference(tight, ExtrapolatedDifferences(scenario, kDifferenceTolerance)));
  if (scenario.jacobian) {
    std::printf(",\n             from quadruple precision by %.1e (which is used)",
                Difference(tight, *scenario.jacobian));
  }
  std::printf("\n");
  return scenario.jacobian ? *scenario.jacobian : tight;
}

}  // namespace

void ReportJacobians(const Scenario& scenario, double limit, Requirements* requirements) {
  std::printf("\n14x14 Jacobian, scenario %s, tolerance %.0e\n", scenario.name.c_str(), kTolerance);
  std::vector<std::unique_ptr<JacobianPeer>> peers;
  peers.push_back(MakeContactFlowJacobian(scenario));
  peers.push_back(MakeDifferenceJacobian(scenario));
  std::vector<std::unique_ptr<Peer>> plain;
  plain.push_back(MakeContactFlow(scenario));
  plain.push_back(MakeContactFlow(scenario));
  if (auto cvodes = MakeCvodesSensitivities(scenario)) {
    peers.push_back(std::move(cvodes));
    plain.push_back(MakeCvodesAdams(scenario));
  } else {
    std::printf("  SKIPPED: CVODES forward sensitivities (built without SUNDIALS)\n");
  }
  const Matrix reference = Reference(scenario, peers[0].get());
  const double largest = reference.cwiseAbs().maxCoeff();

  std::vector<std::function<void()>> tasks;
  for (std::size_t p = 0; p < peers.size(); ++p) {
    tasks.push_back([peer = plain[p].get()] { peer->Run(kTolerance); });
    tasks.push_back([peer = peers[p].get()] { peer->Run(kTolerance); });
  }
  const std::vector<double> seconds = TimeInterleaved(tasks, 5e-3, 15);
  std::printf("  %-30s %10s %10s %12s %16s %10s\n", "", "error", "relative", "plain runs",
              "our plain runs", "us");
  for (std::size_t p = 0; p < peers.size(); ++p) {
    const double error = Difference(peers[p]->Run(kTolerance), reference);
    std::printf("  %-30s %10.1e %10.1e %12.2f %16.2f %10.1f\n", peers[p]->name().c_str(), error,
                error / largest, seconds[2 * p + 1] / seconds[2 * p],
                seconds[2 * p + 1] / seconds[0], 1e6 * seconds[2 * p + 1]);
    if (p == 0) {
      requirements->AtMost(scenario.name + ", Jacobian at 1e-10, in plain runs",
                           seconds[1] / seconds[0], limit);
      requirements->AtMost(scenario.name + ", Jacobian at 1e-10, largest error", error,
                           kLargestError);
    }
  }
}

}  // namespace benchmark
}  // namespace contact_flow
