// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hybrid_system.h"
#include "peer.h"
#include "sections.h"
#include "timing.h"
#include "work_precision.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kLoosest = 1e-5, kTightest = 1e-13;
constexpr int kPerDecade = 5;
constexpr double kReferenceTolerance = 1e-14, kCheckTolerance = 1e-14;

double Difference(const Vector& a, const Vector& b) { return (a - b).cwiseAbs().maxCoeff(); }

/// The outcome, known in advance or from ours at the tightest tolerance, with two checks printed.
Vector Reference(const Scenario& scenario, Peer* ours, Peer* independent) {
  const Vector tight = ours->Run(kReferenceTolerance).state;
  std::printf("  reference: ours at 1e-14, differs from %s at 1e-14 by %.1e",
              independent->name().c_str(),
              Difference(tight, independent->Run(kCheckTolerance).state));
  if (scenario.final_state) {
    std::printf(", from quadruple precision by %.1e (which is used)",
                Difference(tight, *scenario.final_state));
  }
  std::printf("\n");
  return scenario.final_state ? *scenario.final_state : tight;
}

}  // namespace

void ReportPlainRuns(const Scenario& scenario, Requirements* requirements) {
  std::printf("\nPlain run, scenario %s (%s), horizon %g s\n", scenario.name.c_str(),
              scenario.about.c_str(), scenario.duration);
  std::vector<std::unique_ptr<Peer>> peers;
  peers.push_back(MakeContactFlow(scenario));
  peers.push_back(MakeOdeintFehlberg78(scenario));
  peers.push_back(MakeOdeintDopri5(scenario));
  if (auto cvodes = MakeCvodesAdams(scenario)) {
    peers.push_back(std::move(cvodes));
  } else {
    std::printf("  SKIPPED: CVODES Adams (built without SUNDIALS, libsundials-dev)\n");
  }
  const Vector reference = Reference(scenario, peers[0].get(), peers[1].get());

  std::vector<std::vector<WorkPoint>> points(peers.size());
  std::vector<std::function<void()>> tasks;
  const int settings = static_cast<int>(std::lround(std::log10(kLoosest / kTightest))) * kPerDecade;
  for (std::size_t p = 0; p < peers.size(); ++p) {
    Peer* peer = peers[p].get();
    for (int k = 0; k <= settings; ++k) {
      const double tolerance = kLoosest * std::pow(10.0, -static_cast<double>(k) / kPerDecade);
      const RunResult result = peer->Run(tolerance);
      points[p].push_back({tolerance, Difference(result.state, reference),
                           static_cast<double>(result.right_hand_sides), 0});
      tasks.push_back([peer, tolerance] { peer->Run(tolerance); });
    }
  }
  HybridSystem hybrid(scenario);
  Vector xdot(kStates);
  tasks.push_back([&] { hybrid.Field(scenario.x.data(), xdot.data()); });
  std::vector<double> seconds = TimeInterleaved(tasks);
  const double field_seconds = seconds.back();
  seconds.pop_back();
  std::printf("  one right-hand side alone, in flight: %.3f us\n", 1e6 * field_seconds);
  for (std::size_t k = 0; k < seconds.size(); ++k) {
    points[k / (settings + 1)][k % (settings + 1)].seconds = seconds[k];
  }

  std::printf("  %-22s %10s %10s %8s %10s\n", "at equal tolerance", "tolerance", "error", "rhs",
              "us");
  for (std::size_t p = 0; p < peers.size(); ++p) {
    for (int k = kPerDecade; k <= settings; k += 2 * kPerDecade) {
      const WorkPoint& point = points[p][k];
      std::printf("  %-22s %10.0e %10.1e %8.0f %10.1f\n", peers[p]->name().c_str(), point.tolerance,
                  point.error, point.right_hand_sides, 1e6 * point.seconds);
    }
  }
  for (double error : {1e-7, 1e-8, 1e-9, 1e-10, 1e-11}) {
    std::printf("  at equal error %-7.0e %10s %10s %8s %10s %8s\n", error, "tolerance", "us/rhs",
                "rhs", "us", "ratio");
    const WorkAtError ours = FitWork(points[0], error);
    for (std::size_t p = 0; p < peers.size(); ++p) {
      const WorkAtError work = FitWork(points[p], error);
      if (!work.reached) {
        std::printf("  %-22s not reached\n", peers[p]->name().c_str());
        continue;
      }
      std::printf("  %-22s %10.1e %10.3f %8.0f %10.1f %8.2f\n", peers[p]->name().c_str(),
                  work.tolerance, 1e6 * work.seconds / work.right_hand_sides, work.right_hand_sides,
                  1e6 * work.seconds, work.seconds / ours.seconds);
      if (p == 1 && scenario.name == "B" && (error == 1e-8 || error == 1e-10)) {
        requirements->AtMost("B, error " + std::string(error == 1e-8 ? "1e-8" : "1e-10") +
                                 ": our time over odeint fehlberg78's",
                             ours.seconds / work.seconds, 1);
      }
    }
  }
}

}  // namespace benchmark
}  // namespace contact_flow
