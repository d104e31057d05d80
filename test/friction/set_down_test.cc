// SPDX-License-Identifier: BSD-3-Clause
// A tall box is set down at rest on a slope on which it tips over its lower edge. Slips of its
// lower corner that a direction adds stop within a time of first order, and their friction presses
// the upper corner, which leaves from rest.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

constexpr double kHeight = 0.5, kHalfWidth = 0.12;

struct SetDown {
  static constexpr double kDuration = 0.3;  // of its runs
  double s, c;  // of the slope
  std::unique_ptr<RobotSystem> box;
  Vector x;
  SimulateOptions options;
  Trajectory run;

  explicit SetDown(double slope = std::atan(0.3)) : s(std::sin(slope)), c(std::cos(slope)) {
    RobotTexts texts;
    texts.urdf =
        "<robot name=\"box\"><link name=\"box\"><inertial><mass value=\"2\"/><inertia ixx=\"0.2\" "
        "ixy=\"0\" ixz=\"0\" iyy=\"0.2\" iyz=\"0\" izz=\"0.2\"/></inertial></link></robot>";
    std::ostringstream yaml;
    yaml.precision(17);
    yaml << "base: planar\nconstraints:\n";
    for (const double x_of : {kHalfWidth, -kHalfWidth}) {
      yaml << "  " << (x_of > 0 ? "upper" : "lower") << ": {kind: plane, link: box, point: ["
           << x_of << ", 0, " << -kHeight << "], normal: [" << -s << ", 0, " << c
           << "], friction: 0.8}\n";
    }
    texts.yaml = yaml.str();
    box = MakeRobot(texts);
    x = Vector::Zero(6);
    x.head(3) << -s * kHeight, c * kHeight, -slope;
    options.relative_tolerance = 1e-12;
    options.absolute_tolerance = options.speed_tolerance = 1e-12;
    options.dense = true;
    run = Simulate(*box, x, Vector(0), kDuration, options);
  }

  /// Uphill slip of the lower corner and rate of the upper one's gap.
  Vector Direction(double slip, double rise) const {
    const double turn = -rise / (2 * kHalfWidth);
    const double along = slip + turn * kHeight, away = -turn * kHalfWidth;
    Vector w = Vector::Zero(6);
    w.tail(3) << along * c - away * s, along * s + away * c, turn;
    return w;
  }
};

TEST(SetDown, TheCornerThatLeavesIsTouchedAgain) {
  const SetDown down;
  ASSERT_EQ(Outcome::kOk, down.run.status.outcome) << down.run.status.message;
  const BDerivative B = DifferentiateOutcome(*down.box, down.run);
  ASSERT_EQ(Outcome::kOk, B.status.outcome) << B.status.message;
  EXPECT_FALSE(B.PiecewiseLinear().ok());
  int followed = 0, hit = 0;
  for (const double slip : {-1.0, 0.0, 1.0}) {
    for (const double rise : {0.0, 0.05, 0.132, 0.6, 3.0}) {
      const Vector w = down.Direction(slip, rise);
      // The perturbed run tells whether the upper corner is touched, and what follows otherwise.
      const double alpha = 1e-6;
      const Trajectory moved =
          Simulate(*down.box, down.x + alpha * w, Vector(0), SetDown::kDuration, down.options);
      ASSERT_EQ(Outcome::kOk, moved.status.outcome) << moved.status.message;
      bool touched = false;
      for (const Transition& t : moved.transitions) touched = touched || t.activated.Contains(0);
      touched = touched || moved.arcs.front().mode.Contains(0);
      try {
        const Vector answer = B(w);
        const Vector quotient = (moved.FinalState() - down.run.FinalState()) / alpha;
        EXPECT_LT((quotient - answer).cwiseAbs().maxCoeff(), 1e-4 * (1 + answer.norm()))
            << "slip " << slip << ", rise " << rise;
        EXPECT_FALSE(touched) << "slip " << slip << ", rise " << rise;
        ++followed;
      } catch (const std::domain_error& reason) {
        EXPECT_NE(std::string::npos, std::string(reason.what()).find("'upper' touches again"))
            << reason.what();
        EXPECT_TRUE(touched) << "slip " << slip << ", rise " << rise;
        ++hit;
      }
    }
  }
  EXPECT_GE(followed, 8);
  EXPECT_GE(hit, 2);
}

/// A slip that counts as none is none: what sticks does not creep.
TEST(SetDown, ASlipBelowTheToleranceIsMadeRest) {
  const SetDown down(0.1);  // it stands
  ASSERT_EQ("ss", down.run.arcs.front().mode.Word(2));
  Vector x = down.x;
  x.tail(3) << 9e-7 * down.c, 9e-7 * down.s, 0;
  SimulateOptions options = down.options;
  options.speed_tolerance = 1e-6;
  const Trajectory run = Simulate(*down.box, x, Vector(0), SetDown::kDuration, options);
  ASSERT_EQ(Outcome::kOk, run.status.outcome) << run.status.message;
  EXPECT_LT((run.FinalState() - down.run.FinalState()).norm(), 1e-11);
}

}  // namespace
}  // namespace contact_flow
