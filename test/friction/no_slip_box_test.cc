// SPDX-License-Identifier: BSD-3-Clause
// Boxes on feet that never slip, as with much friction: they stand, and land flat.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <sstream>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Tight;

struct Box {
  static constexpr double kDuration = 0.3;  // of its runs
  std::unique_ptr<RobotSystem> system;
  Vector x;  // its base at height 0, at rest

  Box(const std::string& base, const std::string& contact) {
    const bool planar = base == "planar";
    RobotTexts texts;
    texts.urdf =
        "<robot name=\"box\"><link name=\"box\"><inertial><mass value=\"2\"/><inertia ixx=\"0.2\" "
        "ixy=\"0\" ixz=\"0\" iyy=\"0.2\" iyz=\"0\" izz=\"0.2\"/></inertial></link></robot>";
    std::ostringstream yaml;
    yaml << "base: " << base << "\nconstraints:\n";
    int foot = 0;
    for (const char* at : {"0.5, 0.3", "-0.5, 0.3", "-0.5, -0.3", "0.5, -0.3"}) {
      if (planar && foot == 2) break;
      yaml << "  foot" << foot++ << ": {kind: plane, link: box, point: [" << at << ", -0.1], "
           << contact << "}\n";
    }
    texts.yaml = yaml.str();
    system = MakeRobot(texts);
    x = system->nominal().x;
    x(planar ? 1 : 2) = 0.1;
  }
};

Trajectory RunOf(const Box& box, double height, double speed) {
  Vector x = box.x;
  x(x.size() == 6 ? 1 : 2) += height;
  x(box.system->num_positions()) = speed;
  return Simulate(*box.system, x, Vector(0), Box::kDuration, Tight());
}

/// |x(α w) − x(0)|/α beside B(w).
double Quotient(const Box& box, const Trajectory& run, const Vector& w, double alpha,
                const Vector& derivative) {
  const Vector moved = box.system->Perturb(run.arcs.front().x_begin, alpha * w);
  const Trajectory other = Simulate(*box.system, moved, Vector(0), Box::kDuration, Tight());
  EXPECT_EQ(Outcome::kOk, other.status.outcome) << other.status.message;
  const Vector quotient = box.system->Separation(other.FinalState(), run.FinalState()) / alpha;
  return (quotient - derivative).cwiseAbs().maxCoeff();
}

TEST(NoSlipBox, StandsAndLandsFlat) {
  for (const std::string base : {"planar", "floating"}) {
    const Box held(base, "friction: no_slip"), rough(base, "friction: 1e4");
    const std::string word = base == "planar" ? "ss" : "ssss";
    const int d = held.system->dof();
    for (const double height : {0.0, 0.1}) {
      const double speed = height > 0 ? 0.3 : 0;
      const Trajectory run = RunOf(held, height, speed), other = RunOf(rough, height, speed);
      ASSERT_EQ(Outcome::kOk, run.status.outcome) << base << ": " << run.status.message;
      EXPECT_EQ(word, run.arcs.back().mode.Word(held.system->num_constraints()));
      EXPECT_LT(run.FinalState().tail(d).norm(), 1e-9);
      EXPECT_LT((run.FinalState() - other.FinalState()).norm(), 1e-9);
      if (base == "floating" && height > 0) continue;  // the order of its corners decides
      const BDerivative B = DifferentiateOutcome(*held.system, run);
      ASSERT_EQ(Outcome::kOk, B.status.outcome) << B.status.message;
      for (int k = 0; k < 2 * d; ++k) {
        const Vector w = ProjectAdmissible(*held.system, run.arcs.front().x_begin,
                                           run.arcs.front().mode, Vector::Unit(2 * d, k));
        for (const double sign : {1.0, -1.0}) {
          EXPECT_LT(Quotient(held, run, sign * w, 1e-6, B(sign * w)), 1e-5)
              << base << ", direction " << sign * k;
        }
      }
    }
  }
}

TEST(NoSlipBox, BouncesFlat) {
  for (const std::string base : {"planar", "floating"}) {
    const Box box(base, "friction: no_slip, restitution: 0.4");
    const Trajectory run = RunOf(box, 0.1, 0.3);
    ASSERT_EQ(Outcome::kOk, run.status.outcome) << base << ": " << run.status.message;
    ASSERT_FALSE(run.transitions.empty());
    const Transition& hit = run.transitions.front();
    const int d = box.system->dof(), z = base == "planar" ? 1 : 2;
    const Vector v = hit.x_plus.tail(d);
    EXPECT_NEAR(-0.4 * hit.x_minus.tail(d)(z), v(z), 1e-9);
    EXPECT_NEAR(0, v(0), 1e-9) << "its feet are stopped";
    EXPECT_LT(v.norm(), std::abs(v(z)) + 1e-9) << "it does not turn";
  }
}

}  // namespace
}  // namespace contact_flow
