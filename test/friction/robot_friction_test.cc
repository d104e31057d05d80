// SPDX-License-Identifier: BSD-3-Clause
// Robots with friction beside the template systems that they are, and beside runs in quadruple
// precision of these.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/friction_case.h"
#include "test/friction/robot_twins.h"
#include "test/friction/systems/ball.h"
#include "test/friction/systems/puck.h"
#include "test/friction/systems/rod.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Tight;

Trajectory Runs(const MechanicalSystem& system, const Vector& x, double duration) {
  return Simulate(system, x, system.nominal().u, duration, Tight());
}

/// B by the state and one combination of parameters.
Vector Along(const MechanicalSystem& system, const Trajectory& run, const Vector& w,
             const std::vector<std::pair<std::string, double>>& parameters) {
  BDerivativeOptions options;
  options.tolerance = 1e-11;
  std::vector<std::string> names;
  for (const auto& entry : parameters) names.push_back(entry.first);
  options.variables.parameters = ParameterIndices(system.description(), names);
  Vector all(w.size() + static_cast<Eigen::Index>(names.size()));
  all.head(w.size()) = w;
  for (std::size_t i = 0; i < names.size(); ++i) {
    all(w.size() + static_cast<Eigen::Index>(i)) = parameters[i].second;
  }
  const BDerivative B = DifferentiateOutcome(system, run, options);
  EXPECT_TRUE(B.status.ok()) << B.status.message;
  return B.status.ok() ? B(all) : Vector(Vector::Zero(w.size()));
}

void ExpectSameEvents(const Trajectory& expected, const Trajectory& run, int n, int rows) {
  ASSERT_TRUE(expected.status.ok()) << expected.status.message;
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(expected.arcs.size(), run.arcs.size());
  for (std::size_t k = 0; k < run.arcs.size(); ++k) {
    EXPECT_EQ(expected.arcs[k].mode.Word(n), run.arcs[k].mode.Word(n));
  }
  for (std::size_t k = 0; k < run.transitions.size(); ++k) {
    EXPECT_NEAR(expected.transitions[k].t, run.transitions[k].t, 1e-10);
    const Vector& p = run.transitions[k].impulse;
    ASSERT_EQ(rows, p.size());
    EXPECT_LT((expected.transitions[k].impulse - p).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_NEAR(expected.transitions[k].energy_change, run.transitions[k].energy_change, 1e-10);
  }
}

/// The rod sticks, slips backward and reverses: words, times, states, derivatives by state and
/// friction of the run in quadruple precision, by mass of the template.
TEST(RobotFriction, FallingRod) {
  const test::FrictionCase c("falling_rod");
  const auto robot = test::RodRobot(0.3);
  ASSERT_EQ(2, robot->num_tangential());
  const Trajectory run = Runs(*robot, c.x, c.duration), twin = Runs(*c.system, c.x, c.duration);
  ExpectSameEvents(twin, run, 2, 4);
  ASSERT_EQ(static_cast<std::size_t>(c.event_times.size()), run.transitions.size());
  for (std::size_t k = 0; k < run.transitions.size(); ++k) {
    EXPECT_EQ(c.words[k], run.arcs[k].mode.Word(2));
    EXPECT_NEAR(c.event_times(static_cast<Eigen::Index>(k)), run.transitions[k].t, 1e-11);
  }
  EXPECT_LT((run.FinalState() - c.final_state).cwiseAbs().maxCoeff(), 1e-10);
  BDerivativeOptions options;
  options.tolerance = 1e-11;
  const BDerivative B = DifferentiateOutcome(*robot, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (const auto& d : c.derivatives) {
    const double scale = std::max(1.0, d.derivative.cwiseAbs().maxCoeff());
    EXPECT_LT((B(d.direction) - d.derivative).cwiseAbs().maxCoeff(), 1e-8 * scale);
  }
  int compared = 0;
  for (const auto& p : c.by_parameters) {
    if (p.parameter != "mu0") continue;
    const Vector by = Along(*robot, run, Vector::Zero(6), {{"mu0", p.sign}});
    EXPECT_LT((by - p.derivative).cwiseAbs().maxCoeff(),
              1e-8 * std::max(1.0, p.derivative.cwiseAbs().maxCoeff()));
    ++compared;
  }
  EXPECT_GT(compared, 0);
  // The template's inertia grows with its mass.
  const Vector by_mass = Along(*robot, run, Vector::Zero(6), {{"mass", 1}, {"inertia", 0.25 / 3}});
  const Vector expected = Along(*c.system, twin, Vector::Zero(6), {{"mass", 1}});
  EXPECT_LT((by_mass - expected).cwiseAbs().maxCoeff(), 1e-8);
}

/// Thrown, the rod lands sliding on its foot: impulses with friction.
TEST(RobotFriction, ThrownRodLands) {
  const auto robot = test::RodRobot(0.4);
  const auto twin = MakeSystem<test::Rod>({{"mu0", 0.4}, {"mu1", 0.4}});
  Vector x(6);
  x << 0, 0.7, 0.5, 1.2, 0.3, 0.4;
  const double duration = 0.5;
  const Trajectory run = Runs(*robot, x, duration), other = Runs(*twin, x, duration);
  ExpectSameEvents(other, run, 2, 4);
  ASSERT_GT(run.transitions.size(), 0u);
  EXPECT_NE(0, run.transitions[0].impulse(2)) << "friction takes part";
  EXPECT_LT((run.FinalState() - other.FinalState()).cwiseAbs().maxCoeff(), 1e-10);
  for (int j = 0; j < 6; ++j) {
    for (const double sign : {1., -1.}) {
      const Vector w = sign * Vector::Unit(6, j);
      const Vector expected = Along(*twin, other, w, {{"mu0", 0.7}, {"mass", sign}});
      const Vector got =
          Along(*robot, run, w, {{"mu0", 0.7}, {"mass", sign}, {"inertia", sign * 0.25 / 3}});
      EXPECT_LT((got - expected).cwiseAbs().maxCoeff(),
                1e-8 * std::max(1.0, expected.cwiseAbs().maxCoeff()));
    }
  }
}

/// On rails, where the plane of the motion follows from two slides and T is constant.
TEST(RobotFriction, BlockOnAnInclineStops) {
  const double incline = 0.3, mu = 0.6, v0 = 2, g = 9.81;
  const auto robot = test::InclineRobot(incline, mu);
  ASSERT_EQ(1, robot->num_tangential());
  EXPECT_TRUE(robot->HasAffineConstraints());
  Vector x(4);
  x << 0, 0, v0, 0;
  const Trajectory run = Runs(*robot, x, 1.5);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("+", run.arcs[0].mode.Word(1));
  EXPECT_EQ("s", run.arcs[1].mode.Word(1));
  const double brake = g * (mu * std::cos(incline) - std::sin(incline)), stop = v0 / brake;
  EXPECT_NEAR(stop, run.transitions[0].t, 1e-11);
  EXPECT_NEAR(v0 * stop / 2, run.FinalState()(0), 1e-10);
  const Vector by_speed = Along(*robot, run, Vector::Unit(4, 2), {});
  EXPECT_NEAR(stop, by_speed(0), 1e-8);
  EXPECT_NEAR(0, by_speed(2), 1e-8);
  // x = v₀²/(2 brake).
  const Vector by_mu = Along(*robot, run, Vector::Zero(4), {{"mu0", 1}});
  EXPECT_NEAR(-v0 * v0 / (2 * brake * brake) * g * std::cos(incline), by_mu(0), 1e-8);
  EXPECT_LT(Along(*robot, run, Vector::Zero(4), {{"mass", 1}}).cwiseAbs().maxCoeff(), 1e-8);
}

/// In space: thrown, it bounces with friction, slides on a curved path and stops.
TEST(RobotFriction, Puck) {
  const double mu = 0.3, drag = 0.2, fx = 0.5, fy = -0.8;
  const auto robot = test::PuckRobot(mu, 0, drag, fx, fy);
  ASSERT_EQ(2, robot->num_tangential());
  // The robot's drag has a part along z, too.
  const auto twin =
      MakeSystem<test::Puck>({{"mu0", mu}, {"force_x", fx}, {"force_y", fy}, {"drag", drag}});
  Vector x(6);
  x << 0, 0, 0, 2, 1.1, 0;
  const Trajectory run = Runs(*robot, x, 1.5), other = Runs(*twin, x, 1.5);
  ExpectSameEvents(other, run, 1, 3);
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("l", run.arcs[0].mode.Word(1));
  EXPECT_EQ("s", run.arcs[1].mode.Word(1));
  EXPECT_LT((run.FinalState() - other.FinalState()).cwiseAbs().maxCoeff(), 1e-10);
  for (int j : {0, 1, 3, 4}) {
    const Vector w = Vector::Unit(6, j);
    const Vector expected = Along(*twin, other, w, {{"mu0", 0.3}, {"mass", 0.5}});
    const Vector got = Along(*robot, run, w, {{"mu0", 0.3}, {"mass", 0.5}});
    EXPECT_LT((got - expected).cwiseAbs().maxCoeff(), 1e-8);
  }
}

/// A sphere with spin, where T is no gradient: it bounces, slides and rolls. The robot's angular
/// velocity is in body axes, the template's in the world's.
TEST(RobotFriction, BallBouncesAndRolls) {
  const auto robot = test::BallRobot(0.25, 0);
  const auto twin = MakeSystem<test::Ball>({{"mu0", 0.25}});
  Vector x(13), y(12);
  x << 0, 0, 0.05, 1, 0, 0, 0, 1.0, -0.4, 0, 6, 50, 3;
  y << 0, 0, 0.05, 0, 0, 0, 1.0, -0.4, 0, 6, 50, 3;
  const double duration = 0.7;
  const Trajectory run = Runs(*robot, x, duration), other = Runs(*twin, y, duration);
  ExpectSameEvents(other, run, 1, 3);
  ASSERT_EQ(3u, run.arcs.size());
  EXPECT_EQ("l", run.arcs[1].mode.Word(1));
  EXPECT_EQ("s", run.arcs[2].mode.Word(1));
  const Vector& end = run.FinalState();
  const Vector& expected = other.FinalState();
  EXPECT_LT((end.head(3) - expected.head(3)).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((end.segment(7, 3) - expected.segment(6, 3)).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_NEAR(end.tail(3).norm(), expected.tail(3).norm(), 1e-9);
  for (int j : {0, 1, 2, 6, 7, 8, 9, 10, 11}) {
    const Vector w = Vector::Unit(12, j);
    const Vector got =
        Along(*robot, run, w,
              {{"mu0", 0.3}, {"mass", 1}, {"ixx", 0.004}, {"iyy", 0.004}, {"izz", 0.004}});
    const Vector wanted = Along(*twin, other, w, {{"mu0", 0.3}, {"mass", 1}});
    EXPECT_LT((got.head(3) - wanted.head(3)).cwiseAbs().maxCoeff(), 1e-8) << j;
    EXPECT_LT((got.segment(6, 3) - wanted.segment(6, 3)).cwiseAbs().maxCoeff(), 1e-8) << j;
  }
}

/// T of a ball depends on its radius, and the direction of its slip with it: through a bounce, a
/// slide and its end, beside central quotients. With step h = 1e-5 they are off by h² times a third
/// derivative (the radius is 0.1: h²/0.1² of the value) and by the runs' 1e-12/h.
TEST(RobotFriction, ByTheRadius) {
  const double step = 1e-5, radius = 0.1;
  Vector x(13), y(12);
  x << 0, 0, 0.05, 1, 0, 0, 0, 1.0, -0.4, 0, 6, 50, 3;
  y << 0, 0, 0.05, 0, 0, 0, 1.0, -0.4, 0, 6, 50, 3;
  const double duration = 0.7;
  const auto twin = [&](double r) {
    return MakeSystem<test::Ball>({{"mu0", 0.25}, {"radius", r}});
  };
  const auto robot = [&](double r) {
    std::ostringstream yaml;
    yaml.precision(17);
    yaml << "base: floating\ngravity: 9.81\nconstraints:\n  floor: {kind: plane, link: ball, "
         << "offset: -0.1, radius: " << r << ", friction: 0.25}\nparameters: {radius: floor/radius}"
         << "\nnominal: {positions: {base_z: 1}}";
    return test::Robot(
        "<robot name=\"ball\">" + test::Link("ball", 1, 0.004, 0.004, 0.004) + "</robot>",
        yaml.str());
  };
  const auto compare = [&](const MechanicalSystem& at, const MechanicalSystem& more,
                           const MechanicalSystem& less, const Vector& start) {
    const Trajectory run = Runs(at, start, duration);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(3u, run.arcs.size());
    const Vector quotient = at.Separation(Runs(more, start, duration).FinalState(),
                                          Runs(less, start, duration).FinalState()) /
                            (2 * step);
    const Vector by = Along(at, run, Vector::Zero(2 * at.dof()), {{"radius", 1}});
    EXPECT_LT((by - quotient).cwiseAbs().maxCoeff(),
              1e-6 * std::max(1.0, quotient.cwiseAbs().maxCoeff()))
        << by.transpose() << "\n"
        << quotient.transpose();
  };
  compare(*twin(radius), *twin(radius + step), *twin(radius - step), y);
  compare(*robot(radius), *robot(radius + step), *robot(radius - step), x);
}

/// A wheel that does not slip rolls: the angle is the way over the radius; by a rim, by a sphere,
/// and on a plane that another link carries.
TEST(RobotFriction, WheelsRoll) {
  const double radius = 0.25;
  for (const char* contact :
       {"{kind: rim, link: wheel, axis: [0, 1, 0], radius: 0.25, friction: no_slip}",
        "{kind: plane, link: wheel, radius: 0.25, friction: no_slip}",
        "{kind: link_plane, link: wheel, other_link: ground, radius: 0.25, friction: no_slip}"}) {
    const std::string urdf =
        "<robot name=\"wheel\">" + test::Link("ground", 0, 0, 0, 0) +
        test::Link("first", 0, 0, 0, 0) + test::Link("second", 0, 0, 0, 0) +
        test::Link("wheel", 2, 0.1, 0.1, 0.1) + test::Slide("x", "ground", "first", "1 0 0") +
        test::Slide("z", "first", "second", "0 0 1") +
        "<joint name=\"turn\" type=\"continuous\"><parent link=\"second\"/><child "
        "link=\"wheel\"/><axis xyz=\"0 1 0\"/></joint></robot>";
    const auto robot = test::Robot(urdf, std::string("constraints:\n  floor: ") + contact +
                                             "\nnominal: {positions: {z: 0.25}}");
    ASSERT_EQ(1, robot->num_tangential()) << contact;
    Vector x(6);
    x << 0, radius, 0, 1, 0, 1 / radius;
    const Trajectory run = Runs(*robot, x, 1);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_EQ("s", run.arcs[0].mode.Word(1));
    EXPECT_NEAR(1, run.FinalState()(0), 1e-10) << contact;
    EXPECT_NEAR(1 / radius, run.FinalState()(2), 1e-9) << contact;
    x(5) = 0;
    EXPECT_THROW(Runs(*robot, x, 1), std::invalid_argument) << "it slips, and never does";
  }
}

/// A slip that begins in space with the run goes the way it is pushed, also where the start has a
/// slip of its own that counts as none.
TEST(RobotFriction, PuckIsPushedFromRest) {
  const auto robot = test::PuckRobot(0.3, 0, 0, 3, 4);
  for (const double slip : {0.0, 5e-7}) {
    Vector x = Vector::Zero(6);
    x(4) = -slip;
    const Trajectory run = Runs(*robot, x, 1);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.arcs.size());
    EXPECT_EQ("l", run.arcs[0].mode.Word(1));
    const double distance = (5 - 0.3 * 9.81) / 2;
    EXPECT_NEAR(0.6 * distance, run.FinalState()(0), 1e-7);
    EXPECT_NEAR(0.8 * distance, run.FinalState()(1), 1e-7);
    const Status status = DifferentiateOutcome(*robot, run).status;
    EXPECT_EQ(Outcome::kNotPiecewiseLinear, status.outcome);
    EXPECT_NE(std::string::npos, status.message.find("'floor' begins to slip in space"));
  }
}

/// What no one direction of motion can do.
TEST(RobotFriction, TooFewFreedomsAreRefused) {
  const std::string rail = "<robot name=\"rail\">" + test::Link("ground", 0, 0, 0, 0) +
                           test::Link("foot", 1, 0.1, 0.1, 0.1) +
                           test::Slide("z", "ground", "foot", "0 0 1") + "</robot>";
  const std::string foot = "constraints:\n  foot: {kind: plane, link: foot, friction: 0.5}";
  try {
    test::Robot(rail, foot);
    FAIL();
  } catch (const std::invalid_argument& error) {
    const std::string answer = error.what();
    EXPECT_NE(std::string::npos, answer.find("constraints/foot/friction")) << answer;
    EXPECT_NE(std::string::npos, answer.find("1 freedom moves it")) << answer;
    EXPECT_NE(std::string::npos, answer.find("line 2")) << answer;
  }
}

}  // namespace
}  // namespace contact_flow
