// SPDX-License-Identifier: BSD-3-Clause
// Chains of joints with friction, of which the first one meets its stop: the pads of the others
// take no part in that impact, however many there are.
#include <gtest/gtest.h>

#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

std::unique_ptr<RobotSystem> MakeChain(int joints, double restitution) {
  RobotTexts texts;
  texts.urdf = "<robot name=\"chain\"><link name=\"base\"/>";
  std::string parent = "base";
  for (int k = 0; k < joints; ++k) {
    const std::string n = std::to_string(k);
    texts.urdf +=
        "<link name=\"l" + n +
        "\"><inertial><origin xyz=\"0 0 -0.15\"/><mass value=\"1\"/><inertia ixx=\"0.02\" "
        "iyy=\"0.02\" izz=\"0.02\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
        "<joint name=\"j" +
        n + "\" type=\"revolute\"><parent link=\"" + parent + "\"/><child link=\"l" + n +
        "\"/><origin xyz=\"0 0 " + (k > 0 ? "-0.3" : "0") +
        "\"/><axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"0.2\" effort=\"9\" "
        "velocity=\"9\"/><dynamics damping=\"0\" friction=\"0.1\"/></joint>";
    parent = "l" + n;
  }
  texts.urdf += "</robot>";
  texts.yaml = "base: fixed\ngravity: 0\njoints: {limits: [j0], friction: all, restitution: " +
               std::to_string(restitution) + "}\nnominal: {velocities: {j0: 1.5}}\n";
  return MakeRobot(texts);
}

TEST(PadsBesideStops, AreLeftOutOfImpacts) {
  constexpr double kStep = 1e-6;
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-11;
  for (const double restitution : {0.0, 0.5}) {
    for (const int joints : {1, 2, 4, restitution > 0 ? 6 : 3}) {
      const auto chain = MakeChain(joints, restitution);
      const std::string what =
          std::to_string(joints) + " joints, restitution " + std::to_string(restitution);
      const Vector x = chain->nominal().x;
      const auto run_from = [&](const Vector& start) {
        return Simulate(*chain, start, chain->nominal().u, 0.2, options);
      };
      const Trajectory run = run_from(x);
      ASSERT_TRUE(run.status.ok()) << what << ": " << run.status.message;
      for (const Warning& warning : run.warnings) {
        EXPECT_EQ(std::string::npos, warning.message.find("decides")) << what << warning.message;
      }
      const BDerivative B = DifferentiateOutcome(*chain, run);
      ASSERT_TRUE(B.status.ok()) << what << ": " << B.status.message;
      Vector w = Vector::Zero(2 * chain->dof());
      w(chain->dof()) = 1;
      for (const double sign : {1.0, -1.0}) {
        const Vector moved = run_from(chain->Perturb(x, sign * kStep * w)).FinalState();
        const Vector quotient = chain->Separation(moved, run.FinalState()) / kStep;
        EXPECT_LE((quotient - B(sign * w)).cwiseAbs().maxCoeff(), 1e-3) << what;
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
