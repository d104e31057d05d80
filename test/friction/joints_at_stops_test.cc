// SPDX-License-Identifier: BSD-3-Clause
// Joints with friction that rest on their stops: friction and stop hold them together, whatever
// the share of each, and the motion, its letters and its derivatives are those of both.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/dynamics/friction_problem.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Entries;
using test::Link;
using test::Robot;

/// A slide of 2 kg with friction 1, 0.1 below its stop.
constexpr double kSlideMass = 2, kStopAt = 0.1;
std::unique_ptr<RobotSystem> StoppedSlide() {
  return Robot(
      "<robot name='slide'>" + Link("ground", 0, 0, 0, 0) + Link("A", kSlideMass, 1, 1, 1) +
          "<joint name='j' type='prismatic'><parent link='ground'/><child link='A'/>"
          "<axis xyz='1 0 0'/><limit lower='-9' upper='0.1' effort='9' velocity='9'/>"
          "<dynamics friction='1'/></joint></robot>",
      "base: fixed\njoints: {limits: [j], friction: [j]}\nefforts: {push: {kind: actuator, "
      "joint: j, input: u}}\nparameters: {stop: j_upper/upper, friction: "
      "j_friction/friction}\n");
}

/// Pushed onto its stop, pulled by less than its friction, and by more: then it slides away,
/// against its friction, by (u − τ) t²/(2 m).
TEST(JointsAtStops, FrictionHoldsUntilTheEffortIsLarger) {
  const auto robot = StoppedSlide();
  const InputSchedule schedule{{0, 0.3, 0.5, 0.7},
                               {Entries({5}), Entries({-0.5}), Entries({0.5}), Entries({-3})}};
  const Trajectory run = Simulate(*robot, Entries({0, 0, 1, 0}), schedule, 1, AtTolerance(1e-11));
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_TRUE(run.warnings.empty()) << run.warnings.front().message;
  const double t = 0.3;
  EXPECT_NEAR(kStopAt - (3 - 1) / kSlideMass * t * t / 2, run.FinalState()(0), 1e-9);
  EXPECT_EQ("oo-", run.arcs.back().mode.Word(3));
  for (const double at : {0.2, 0.4, 0.6}) EXPECT_NEAR(kStopAt, run.State(at)(0), 1e-10) << at;
  BDerivativeOptions options;
  options.variables.parameters = ParameterIndices(robot->description(), {"stop", "friction"});
  const BDerivative B = DifferentiateOutcome(*robot, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const auto by = [&](int j) { return B(Vector::Unit(6, j))(0); };
  EXPECT_NEAR(0, by(0), 1e-9) << "by where it began";
  EXPECT_NEAR(0, by(2), 1e-9) << "by its speed";
  EXPECT_NEAR(1, by(4), 1e-9) << "by its stop";
  EXPECT_NEAR(t * t / (2 * kSlideMass), by(5), 1e-9) << "by its friction";
}

/// A yaw that its friction holds, across the pitch that meets its stop: what rounding leaves of
/// their coupling throws nothing along.
TEST(JointsAtStops, AnImpactAcrossLeavesAJointStuck) {
  const auto link = [](const char* name, double mass, double ixx, double iyy, double izz, double x,
                       double z) {
    std::ostringstream text;
    text << "<link name='" << name << "'><inertial><origin xyz='" << x << " 0 " << z
         << "'/><mass value='" << mass << "'/><inertia ixx='" << ixx << "' iyy='" << iyy
         << "' izz='" << izz << "' ixy='0' ixz='0' iyz='0'/></inertial></link>";
    return text.str();
  };
  for (const char* turned : {"0 0 0", "0.3 0.2 0.1", "1 2 3"}) {
    for (const double aside : {0., 0.1}) {
      const auto robot = Robot(
          "<robot name='r'>" + Link("b", 0, 0, 0, 0) + link("a", 1.3, 0.02, 0.03, 0.017, 0, 0.1) +
              link("c", 0.7, 0.011, 0.013, 0.007, aside, -0.2) +
              "<joint name='yaw' type='revolute'><parent link='b'/><child link='a'/><origin "
              "rpy='" +
              turned +
              "'/><axis xyz='0 0 1'/><limit lower='-3' upper='3' effort='1' velocity='1'/>"
              "<dynamics friction='2'/></joint><joint name='pitch' type='revolute'><parent "
              "link='a'/><child link='c'/><origin xyz='0 0 0.37' rpy='0 0.7 0'/><axis xyz='0 1 0'/>"
              "<limit lower='-1' upper='0.5' effort='1' velocity='1'/><dynamics friction='0.1'/>"
              "</joint></robot>",
          "base: fixed\ngravity: 0\njoints: {limits: [pitch], friction: all}\nefforts: {e: {kind: "
          "actuator, joint: yaw, input: u}, f: {kind: actuator, joint: pitch, input: v}}\nnominal: "
          "{velocities: {pitch: 2}, inputs: {u: 1.5, v: 0.3}}\n");
      const Vector x = robot->nominal().x, u = robot->nominal().u;
      const auto from = [&](double speed) {
        return Simulate(*robot, x + (speed - 2) * Vector::Unit(8, 5), u, 0.5, AtTolerance(1e-12));
      };
      const Trajectory run = from(2);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      ASSERT_EQ(2u, run.arcs.size()) << turned << ' ' << aside;
      EXPECT_EQ("olss", run.arcs.back().mode.Word(4));
      const BDerivative B = DifferentiateOutcome(*robot, run);
      ASSERT_TRUE(B.status.ok()) << turned << ' ' << aside << ": " << B.status.message;
      const Vector quotient = (from(2 + 1e-6).FinalState() - run.FinalState()) / 1e-6;
      EXPECT_TRUE((B(Vector::Unit(8, 5)) - quotient).isZero(1e-5)) << quotient.transpose();
    }
  }
}

/// A speed that is given to a joint which sticks is ended by its friction alone, along M⁻¹ of that
/// joint, in any units: the frictions of others are what they were.
TEST(JointsAtStops, OtherPadsDoNotFeelAStop) {
  for (const double mass : {1., 1e9}) {
    const std::string most = std::to_string(20 * mass), m = std::to_string(mass),
                      inertia = std::to_string(0.02 * mass);
    std::string urdf = "<robot name='r'><link name='l'/>", parent = "l";
    for (const char* n : {"0", "1", "2"}) {
      urdf += "<link name='l" + std::string(n) +
              "'><inertial><origin xyz='0 0 -0.15'/><mass value='" + m + "'/><inertia ixx='" +
              inertia + "' iyy='" + inertia + "' izz='" + inertia +
              "' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j" + n +
              "' type='continuous'><parent link='" + parent + "'/><child link='l" + n +
              "'/><origin xyz='0 0 -0.3'/><axis xyz='0 1 0'/><dynamics friction='" +
              (parent == "l" ? most : m) + "'/></joint>";
      parent = "l" + std::string(n);
    }
    const auto robot = Robot(urdf + "</robot>",
                             "base: fixed\ngravity: 0\njoints: {friction: all}\nnominal: "
                             "{positions: {j1: 0.2, j2: -0.4}, velocities: {j1: 1, j2: 0.8}}\n");
    const auto from = [&](double speed) {
      const Vector x = robot->nominal().x + speed * Vector::Unit(12, 6);
      return Simulate(*robot, x, Vector(), 1e-4, AtTolerance(1e-12));
    };
    const Trajectory run = from(0);
    ASSERT_EQ("s++", run.arcs.front().mode.Word(3));
    const BDerivative B = DifferentiateOutcome(*robot, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    for (const double sign : {1., -1.}) {
      constexpr double kStep = 1e-5;
      const Vector quotient = (from(sign * kStep).FinalState() - run.FinalState()) / kStep;
      EXPECT_TRUE((B(sign * Vector::Unit(12, 6)) - quotient).isZero(1e-3))
          << mass << ": " << quotient.transpose();
    }
  }
}

/// Its stop and five pads that feel each other: complementarity and Coulomb's law as they are.
TEST(JointsAtStops, MotionsBesideManyPadsFollowTheLaws) {
  constexpr int kJoints = 5;
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    const double unit = std::pow(10, 3 * normal(random));  // of joints
    Matrix root(kJoints, kJoints);
    for (double& entry : root.reshaped()) entry = normal(random);
    const Matrix inverse = unit * (root * root.transpose() + Matrix::Identity(kJoints, kJoints));
    // Rows: the stop of joint 0, below it; of each joint its pad's normal and tangential row.
    FrictionProblem problem;
    Matrix A = Matrix::Zero(1 + 2 * kJoints, 2 * kJoints),
           P = Matrix::Zero(2 * kJoints, 2 * kJoints);
    P.topLeftCorner(kJoints, kJoints) = inverse;
    P.bottomRightCorner(kJoints, kJoints).setIdentity();
    problem.contacts.emplace_back();
    const double side = trial % 2 == 0 ? 1 : -1;
    A(0, 0) = side;
    Vector free = Vector::Zero(2 * kJoints);
    for (int j = 0; j < kJoints; ++j) {
      FrictionContact pad;
      pad.dimension = 1;
      pad.coefficient = std::abs(normal(random));
      pad.slips = j > 0 && normal(random) > 0;
      pad.direction(0) = normal(random) > 0 ? 1 : -1;
      problem.contacts.push_back(pad);
      A(1 + 2 * j, kJoints + j) = A(2 + 2 * j, j) = 1;
      free(j) = unit * normal(random);
      free(kJoints + j) = -1;
    }
    problem.G = A * P * A.transpose();
    problem.b = A * free;
    const std::vector<FrictionSolution> all = SolveFriction(problem);
    ASSERT_EQ(1u, all.size()) << trial;
    const FrictionSolution& found = all.front();
    EXPECT_FALSE(found.springs || found.many) << trial;
    const double rounding = 1e-9 * problem.b.cwiseAbs().maxCoeff(), small = rounding / unit;
    const Vector y = problem.G * found.force + problem.b;
    EXPECT_TRUE((y - found.result).isZero(rounding)) << trial;
    EXPECT_GE(found.force(0), -small);
    EXPECT_GE(y(0), -rounding);
    EXPECT_LE(std::min(found.force(0) * unit, y(0)), rounding);
    for (int j = 0; j < kJoints; ++j) {
      const FrictionContact& pad = problem.contacts[static_cast<std::size_t>(1 + j)];
      EXPECT_NEAR(1, found.force(1 + 2 * j), 1e-9);
      const double push = found.force(2 + 2 * j), slip = y(2 + 2 * j);
      const double sign = pad.slips ? pad.direction(0) : slip > 0 ? 1 : -1;
      EXPECT_LE(std::abs(push), pad.coefficient + small);
      if (pad.slips || std::abs(slip) > rounding) {
        EXPECT_NEAR(-sign * pad.coefficient, push, small) << trial << ' ' << j;
      }
    }
    const bool rests = y(0) <= rounding;
    EXPECT_EQ(rests, found.letters[0] != Letter::kOpen);
    EXPECT_EQ(rests      ? Letter::kStick
              : side > 0 ? Letter::kForward
                         : Letter::kBackward,
              found.letters[1]);
  }
}

/// Arms whose joints have friction, damping and stops, in units of their own.
struct StoppedArm {
  RobotTexts texts;
  Vector size;  // of directions (δq, δv, δu, δp)
  double time;
};

StoppedArm RandomArm(int seed) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::uniform_real_distribution<double> part(0, 1);
  std::normal_distribution<double> normal;
  const auto between = [&](double low, double high) { return low + (high - low) * part(random); };
  const bool scaled = seed % 2 == 1;
  const double length = scaled ? std::pow(10, between(-2, 2)) : 1;
  const double mass = scaled ? std::pow(10, between(-3, 3)) : 1;
  const double time = scaled ? std::pow(10, between(-2, 2)) : 1;
  const double inertia = mass * length * length, torque = inertia / (time * time);
  const int joints = 1 + seed % 5;
  std::ostringstream urdf, efforts, speeds, places, inputs, parameters;
  for (std::ostringstream* out : {&urdf, &efforts, &speeds, &places, &inputs, &parameters}) {
    out->precision(17);
  }
  urdf << "<robot name='arm'><link name='l'/>";
  std::string parent = "l";
  StoppedArm arm;
  arm.time = 0.35 * time;
  arm.size = Vector::Zero(7 * joints);
  for (int k = 0; k < joints; ++k) {
    const std::string n = std::to_string(k), comma = k > 0 ? ", " : "";
    const double low = -between(0.2, 1), high = between(0.2, 1);
    urdf << "<link name='l" << n << "'><inertial><origin xyz='" << 0.03 * length * part(random)
         << " 0 " << -0.15 * length << "'/><mass value='" << between(0.3, 2) * mass
         << "'/><inertia ixx='" << 0.02 * inertia << "' iyy='" << 0.02 * inertia << "' izz='"
         << 0.01 * inertia << "' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j" << n
         << "' type='revolute'><parent link='" << parent << "'/><child link='l" << n
         << "'/><origin xyz='0 0 " << (k > 0 ? -0.3 * length : 0)
         << "'/><axis xyz='0 1 0'/><limit lower='" << low << "' upper='" << high
         << "' effort='1' velocity='1'/><dynamics damping='" << between(0.02, 0.4) * torque * time
         << "' friction='" << between(0.05, 3) * torque << "'/></joint>";
    efforts << comma << 'e' << n << ": {kind: actuator, joint: j" << n << ", input: u" << n << '}';
    inputs << comma << 'u' << n << ": " << 3 * normal(random) * torque;
    places << comma << 'j' << n << ": " << 0.9 * between(low, high);
    speeds << comma << 'j' << n << ": " << 3 * normal(random) / time;
    parameters << comma << 'f' << n << ": j" << n << "_friction/friction, s" << n << ": j" << n
               << "_upper/upper";
    arm.size(k) = 1;
    arm.size(2 * joints + k) = 1 / time;
    arm.size(4 * joints + k) = torque;
    arm.size(5 * joints + 2 * k) = torque;
    arm.size(5 * joints + 2 * k + 1) = 1;
    parent = "l" + n;
  }
  urdf << "</robot>";
  arm.texts.urdf = urdf.str();
  std::ostringstream yaml;
  yaml.precision(17);
  yaml << "base: fixed\ngravity: " << 9.81 * length / (time * time)
       << "\njoints: {limits: all, friction: all, damping: all}\nefforts: {" << efforts.str()
       << "}\nparameters: {" << parameters.str() << "}\nnominal: {positions: {" << places.str()
       << "}, velocities: {" << speeds.str() << "}, inputs: {" << inputs.str() << "}}\n";
  arm.texts.yaml = yaml.str();
  return arm;
}

/// None is stopped, none is said to depend on shares, and no derivative contradicts quotients. A
/// few arms bounce to and fro between two stops ever faster: these are told as such.
TEST(JointsAtStops, RandomArms) {
  constexpr int kArms = 30;
  int accumulate = 0, rest = 0;
  for (int seed = 0; seed < kArms; ++seed) {
    const StoppedArm arm = RandomArm(seed);
    const auto robot = MakeRobot(arm.texts);
    const Vector x = robot->nominal().x, u = robot->nominal().u;
    const SimulateOptions options = AtTolerance(1e-12);
    const Trajectory run = Simulate(*robot, x, u, arm.time, options);
    ASSERT_TRUE(run.status.ok()) << seed << ": " << run.status.message;
    bool zeno = false;
    for (const Warning& warning : run.warnings) {
      EXPECT_NE(Outcome::kIndeterminateForces, warning.code) << seed << ": " << warning.message;
      zeno = zeno || warning.code == Outcome::kZeno;
    }
    for (const Transition& event : run.transitions) zeno = zeno || !event.obstacle.ok();
    BDerivativeOptions wanted;
    wanted.variables.inputs = true;
    for (int k = 0; k < static_cast<int>(robot->description().parameters.size()); ++k) {
      wanted.variables.parameters.push_back(k);
    }
    const BDerivative B = DifferentiateOutcome(*robot, run, wanted);
    EXPECT_EQ(!zeno, B.status.ok()) << seed << ": " << B.status.message;
    accumulate += zeno;
    for (const Arc& arc : run.arcs) rest += arc.mode.Word(robot->num_constraints()).find('l') == 0;
    if (!B.status.ok()) {
      EXPECT_EQ(std::string::npos, B.status.message.find("self-check")) << B.status.message;
      continue;
    }
    const SystemFactory again = [&](const ParameterValues& values) {
      return MakeRobot(arm.texts, values);
    };
    std::mt19937 random(static_cast<unsigned>(seed));
    std::normal_distribution<double> normal;
    Vector w = arm.size;
    for (double& entry : w) entry *= normal(random);
    for (const double sign : {1., -1.}) {
      const Vector tangent = B(sign * w);
      const QuotientReport report =
          CompareWithQuotients(*robot, again, wanted.variables, x, {{0}, {u}}, arm.time, sign * w,
                               tangent, {1e-5, 1e-6, 1e-7}, options);
      double least = 1e300;
      for (const auto& sample : report.samples) least = std::min(least, sample.error);
      EXPECT_LE(least, 1e-3 * (1 + tangent.cwiseAbs().maxCoeff())) << seed << ' ' << sign;
    }
  }
  EXPECT_GT(rest, 0);
  EXPECT_LE(accumulate, kArms / 3);
}

}  // namespace
}  // namespace contact_flow
