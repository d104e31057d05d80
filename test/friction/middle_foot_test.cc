// SPDX-License-Identifier: BSD-3-Clause
// A box that rocks from one edge of its base onto the other. Feet between its corners land with the
// corner that lands, whatever the direction: they change nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

std::unique_ptr<RobotSystem> BoxOnFeet(const std::vector<double>& feet,
                                       const std::string& contact) {
  RobotTexts texts;
  texts.urdf =
      "<robot name=\"box\"><link name=\"box\"><inertial><mass value=\"2\"/><inertia ixx=\"0.2\" "
      "ixy=\"0\" ixz=\"0\" iyy=\"0.2\" iyz=\"0\" izz=\"0.2\"/></inertial></link></robot>";
  std::ostringstream yaml;
  yaml << "base: planar\nconstraints:\n";
  for (std::size_t k = 0; k < feet.size(); ++k) {
    yaml << "  foot" << k << ": {kind: plane, link: box, point: [" << feet[k] << ", 0, -0.3], "
         << contact << "}\n";
  }
  texts.yaml = yaml.str();
  return MakeRobot(texts);
}

/// Columns B(w) along directions that keep the corner on which it stands.
Matrix Derivative(const RobotSystem& box) {
  const double pitch = 0.15, s = std::sin(pitch), c = std::cos(pitch), duration = 0.22;
  Vector x = Vector::Zero(6);
  x.head(3) << 0, 0.3 * c + 0.3 * s, pitch;
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  options.dense = true;
  const Trajectory run = Simulate(box, x, Vector(0), duration, options);
  EXPECT_EQ(Outcome::kOk, run.status.outcome) << run.status.message;
  EXPECT_EQ(1u, run.transitions.size());
  const BDerivative B = DifferentiateOutcome(box, run);
  EXPECT_EQ(Outcome::kOk, B.status.outcome) << B.status.message;
  if (!B.status.ok()) return Matrix::Zero(6, 6);
  Matrix columns(6, 6);
  for (int k = 0; k < 6; ++k) {
    columns.col(k) = B(ProjectAdmissible(box, x, run.arcs.front().mode, Vector::Unit(6, k)));
  }
  return columns;
}

TEST(MiddleFoot, ChangesNothing) {
  for (const std::string contact :
       {"friction: 0.5", "friction: no_slip", "friction: 0.5, restitution: 0.4"}) {
    const Matrix two = Derivative(*BoxOnFeet({-0.3, 0.3}, contact));
    EXPECT_GT(two.norm(), 1);
    for (const std::vector<double>& feet :
         {std::vector<double>{-0.3, 0, 0.3}, {-0.3, 0.1, 0.3}, {-0.3, -0.1, 0.1, 0.3}}) {
      EXPECT_LT((Derivative(*BoxOnFeet(feet, contact)) - two).cwiseAbs().maxCoeff(), 1e-8)
          << contact << ", " << feet.size() << " feet";
    }
  }
}

}  // namespace
}  // namespace contact_flow
