// SPDX-License-Identifier: BSD-3-Clause
// Boxes that slip out of an uneven grip and slide on their pads, while fingertips that stick, or
// creep on their cones, share what they bear.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

struct Grip {
  double friction, mass;      // [kg]
  double held;                // [N] by each finger, until it is loosened
  double left, right;         // [N]
  double spin = 0, push = 0;  // of the box about x, and of all along x
};

constexpr double kLoosened = 0.1, kGripEnd = 0.2;  // [s]

/// Of random ones, those whose runs once ended in slips of rounding.
const std::vector<Grip> kGrips = {{0.3895922446745461, 0.8515102380494541, 19.21260497943343,
                                   5.174625470685361, 3.69117821754634},
                                  {0.30004009938013243, 0.36011542047381734, 7.882266115116156,
                                   3.71946047677929, 3.2053780779843413},
                                  {0.714539007446354, 0.484035129175052, 4.236003702369273,
                                   0.6921349282963641, 0.4506421001506679},
                                  {0.6066759542414399, 0.5752492499738138, 8.766075449295512,
                                   2.0557915146308727, 1.887935227553728},
                                  {0.6768119177725209, 0.35695775179536665, 3.7958808474018286,
                                   0.5866640416655267, 0.6742953931327993}};

/// Of boxes that turn about x and move along it, whose slips end together.
const std::vector<Grip> kTurning = {
    {0.674818418673969, 0.8698124969084635, 8.51255545669684, 2.77278755522802, 2.77278755522802,
     -0.0385819262774247, -0.0009256369053893969},
    {0.504413244153096, 0.5116340865241826, 7.9274666260993385, 2.035612661049088,
     2.035612661049088, -0.00924569174513794, 0.005023479821038285},
    {0.36954802478794463, 0.3797664893727742, 9.645966518341849, 2.018205950503678,
     2.2101648069877347, 0.012520757430926855, 0.005499662612192594}};

std::unique_ptr<MechanicalSystem> GripperOf(const Grip& grip) {
  return LoadRobot(RobotFile("gripper_friction"),
                   {{"friction", grip.friction}, {"box_mass", grip.mass}});
}

Trajectory Loosen(const MechanicalSystem& robot, const Grip& grip, double tolerance) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = tolerance;
  const auto& names = robot.description().velocities;
  const auto speed = [&](const char* name) {
    return robot.num_positions() +
           static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  Vector x = robot.nominal().x;
  for (const char* name : {"box_x", "left_slide", "right_slide"}) x(speed(name)) = grip.push;
  x(speed("box_wx")) = grip.spin;
  const Eigen::Vector2d held(grip.held, -grip.held), loose(grip.left, -grip.right);
  return Simulate(robot, x, {{0, kLoosened}, {held, loose}}, kGripEnd, options);
}

/// Accelerations where contacts of the mode stand on equal springs of this softness, relative, by
/// projections until nothing moves: a law that no code of ours has.
Vector OnSprings(const MechanicalSystem& robot, const Vector& x, const Vector& u, ContactMode mode,
                 double softness) {
  const int nq = robot.num_positions(), d = robot.dof();
  Matrix M(d, d);
  Vector f(d);
  robot.Dynamics(x.head(nq), x.tail(d), u, mode, &M, &f);
  ConstraintTerms terms;
  robot.Constraints(x.head(nq), x.tail(d), &terms);
  const Matrix& A = terms.jacobian;
  const Matrix G = A * M.ldlt().solve(A.transpose());
  const Vector b = A * M.ldlt().solve(f) + terms.bias, rate = A * x.tail(d);
  const double size = G.diagonal().maxCoeff(), step = 0.2 / size;
  Vector force = Vector::Zero(A.rows());
  for (int k = 0; k < 2000000; ++k) {
    const Vector trial = force - step * (G * force + b + softness * size * force);
    Vector next = Vector::Zero(A.rows());
    for (int i : mode) {
      const Friction& friction = robot.friction()[i];
      const int t = friction.row;
      next(i) = std::max(0.0, trial(i));
      const double radius = friction.coefficient * next(i);
      if (mode.LetterOf(i) == Letter::kStick) {
        const Eigen::Vector2d pull = trial.segment<2>(t);
        next.segment<2>(t) = pull * std::min(1.0, radius / pull.norm());
      } else {
        next.segment<2>(t) = -radius * rate.segment<2>(t).normalized();
      }
    }
    const double moved = (next - force).cwiseAbs().maxCoeff();
    force = next;
    if (moved < 1e-15) break;
  }
  return M.ldlt().solve(f + A.transpose() * force);
}

double Energy(const MechanicalSystem& robot, const Vector& x, double mass) {
  const int nq = robot.num_positions(), d = robot.dof();
  Matrix M(d, d);
  Vector f(d);
  robot.Dynamics(x.head(nq), x.tail(d), Vector::Zero(2), ContactMode(), &M, &f);
  return 0.5 * x.tail(d).dot(M * x.tail(d)) + mass * 9.81 * x(2);
}

/// They go on to the end, with forces in their cones, at any tolerance to the same state.
TEST(UnevenGrip, BoxesSlideOnBetweenFingersThatShareForces) {
  for (const Grip& grip : kGrips) {
    const auto robot = GripperOf(grip);
    const Trajectory run = Loosen(*robot, grip, 1e-11), finer = Loosen(*robot, grip, 1e-12);
    ASSERT_TRUE(run.status.ok()) << grip.mass << ": " << run.status.message;
    ASSERT_TRUE(finer.status.ok()) << grip.mass << ": " << finer.status.message;
    EXPECT_LT((run.FinalState() - finer.FinalState()).cwiseAbs().maxCoeff(), 1e-8) << grip.mass;
    EXPECT_TRUE(std::any_of(run.warnings.begin(), run.warnings.end(), [](const Warning& w) {
      return w.code == Outcome::kIndeterminateForces;
    })) << grip.mass;
    for (const Arc& arc : run.arcs) {
      if (arc.t_begin < kLoosened) continue;
      const Eigen::Vector2d u(grip.left, -grip.right);
      ContactDynamics dynamics(*robot, u);
      for (const double part : {0.1, 0.5, 0.9}) {
        const double t = arc.t_begin + part * (arc.t_end - arc.t_begin);
        dynamics.Evaluate(run.State(t), arc.mode);
        const Vector& force = dynamics.force();
        const double rounding = 1e-8 * force.cwiseAbs().maxCoeff();
        for (int i : arc.mode) {
          const Friction& friction = robot->friction()[i];
          EXPECT_GE(force(i), -rounding) << grip.mass << " at " << t;
          EXPECT_LE(force.segment<2>(friction.row).norm(),
                    friction.coefficient * force(i) + rounding)
              << grip.mass << " at " << t << ": " << i;
        }
      }
    }
  }
}

/// Where shares decide the motion they are those of equal springs, also where some of these creep
/// on their cones.
TEST(UnevenGrip, FingersThatCreepShareAsEqualSprings) {
  int compared = 0, creeping = 0;
  for (const Grip& grip : kGrips) {
    const auto robot = GripperOf(grip);
    const Trajectory run = Loosen(*robot, grip, 1e-11);
    const Eigen::Vector2d u(grip.left, -grip.right);
    ContactDynamics dynamics(*robot, u);
    for (const Arc& arc : run.arcs) {
      if (arc.t_begin < kLoosened || arc.t_end - arc.t_begin < 1e-4) continue;
      const Vector x = run.State(0.5 * (arc.t_begin + arc.t_end));
      dynamics.Evaluate(x, arc.mode);
      if (dynamics.springs().Empty()) continue;
      const Vector v = dynamics.acceleration();
      // What softness changes is a polynomial of it: a quadratic one is taken away.
      const Vector limit =
          (8 * OnSprings(*robot, x, u, arc.mode, 1e-4) -
           6 * OnSprings(*robot, x, u, arc.mode, 2e-4) + OnSprings(*robot, x, u, arc.mode, 4e-4)) /
          3;
      EXPECT_LT((v - limit).cwiseAbs().maxCoeff(), 5e-4 * (1 + v.cwiseAbs().maxCoeff()))
          << grip.mass << " at " << arc.t_begin << ' ' << arc.mode.Word(5) << ": " << v.transpose()
          << " beside " << limit.transpose();
      ++compared;
      creeping += dynamics.shared_slack() < 0;
    }
  }
  EXPECT_GE(compared, 5);
  EXPECT_GE(creeping, 3);
}

/// Boxes that turn as they slip come to rest on two or three pads and two tips at once: what slips
/// no faster than others begin to slip beside it is as still as these.
TEST(UnevenGrip, BoxesThatTurnComeToRest) {
  for (const Grip& grip : kTurning) {
    const auto robot = GripperOf(grip);
    const Trajectory run = Loosen(*robot, grip, 1e-11), finer = Loosen(*robot, grip, 1e-12);
    ASSERT_TRUE(run.status.ok()) << grip.mass << ": " << run.status.message;
    ASSERT_TRUE(finer.status.ok()) << grip.mass << ": " << finer.status.message;
    EXPECT_LT((run.FinalState() - finer.FinalState()).cwiseAbs().maxCoeff(), 1e-6) << grip.mass;
    EXPECT_LT(Energy(*robot, run.FinalState(), grip.mass),
              Energy(*robot, robot->nominal().x, grip.mass));
  }
}

}  // namespace
}  // namespace contact_flow
