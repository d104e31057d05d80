// SPDX-License-Identifier: BSD-3-Clause
// Errors that a second, finer run measures, against those that a run to 1e-13 shows.
#include "contact_flow/derivative/measured_errors.h"

#include <gtest/gtest.h>

#include <random>

#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

SimulateOptions To(double tolerance) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = tolerance;
  return options;
}

/// A box that falls on its corners: arcs of very different lengths, of one or two steps each.
TEST(MeasuredErrors, AreNotThoseOfAnArcThatIsRepeatedAsItWas) {
  const auto box = MakeModel("falling_box");
  const NominalRun& nominal = box->nominal();
  const InputSchedule input = InputSchedule::Constant(nominal.u);
  int compared = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Vector spread(2 * box->dof()), w(2 * box->dof());
    for (double& entry : spread) entry = 0.03 * normal(random);
    for (double& entry : w) entry = normal(random);
    const Vector x = box->Perturb(nominal.x, spread);
    const double duration = std::uniform_real_distribution<double>(0.3, 0.72)(random);
    const SimulateOptions options = To(1e-6);
    const Trajectory run = Simulate(*box, x, input, duration, options);
    const Trajectory fine = Simulate(*box, x, input, duration, To(1e-13));
    if (!run.status.ok() || run.ModeSequence() != fine.ModeSequence()) continue;
    BDerivativeOptions tight;
    tight.tolerance = 1e-12;
    const BDerivative B = DifferentiateOutcome(*box, run);
    const BDerivative exact = DifferentiateOutcome(*box, fine, tight);
    if (!B.status.ok() || !exact.status.ok()) continue;
    const MeasuredErrors errors(*box, x, input, duration, options, run, B);
    const double off = (B(w) - exact(w)).cwiseAbs().maxCoeff();
    EXPECT_LE(off, 2 * errors.Along(w).maxCoeff() + 1e-11) << "seed " << seed;
    ++compared;
  }
  EXPECT_GT(compared, 30);
}

}  // namespace
}  // namespace contact_flow
