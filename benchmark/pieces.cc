// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <functional>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "sections.h"
#include "timing.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kTolerance = 1e-10;
constexpr double kLargestRatio = 1.2;

/// The selection of one order of activations, over all arcs.
Matrix OnePiece(const BDerivative& derivative) {
  Matrix product = derivative.arcs.front();
  for (std::size_t k = 0; k < derivative.events.size(); ++k) {
    const EventMap& event = derivative.events[k];
    product = derivative.arcs[k + 1] * (event.Selection(event.activated()) * product);
  }
  return product;
}

}  // namespace

void ReportPieces(const Scenario& scenario, Requirements* requirements) {
  std::printf("\nPieces, scenario %s (%s)\n", scenario.name.c_str(), scenario.about.c_str());
  const MechanicalSystem& system = *scenario.system;
  SimulateOptions simulate;
  simulate.relative_tolerance = simulate.absolute_tolerance = kTolerance;
  BDerivativeOptions differentiate;
  differentiate.tolerance = kTolerance;
  const auto flow = [&] {
    return Simulate(system, scenario.x, scenario.u, scenario.duration, simulate);
  };
  const Trajectory trajectory = flow();
  const auto derive = [&] { return DifferentiateOutcome(system, trajectory, differentiate); };
  std::size_t count = 0;
  Matrix one;
  const std::vector<double> seconds =
      TimeInterleaved({
                          [&] { flow(); },
                          [&] { one = OnePiece(derive()); },
                          [&] { count = derive().Pieces().pieces().size(); },
                      },
                      5e-3, 15);
  std::printf("  one piece %.1f us, all %zu pieces %.1f us: ratio %.3f (with the run: %.3f)\n",
              1e6 * seconds[1], count, 1e6 * seconds[2], seconds[2] / seconds[1],
              (seconds[0] + seconds[2]) / (seconds[0] + seconds[1]));
  requirements->AtMost("both pieces of the simultaneous touchdown over one",
                       seconds[2] / seconds[1], kLargestRatio);
}

}  // namespace benchmark
}  // namespace contact_flow
