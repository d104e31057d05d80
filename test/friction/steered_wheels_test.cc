// SPDX-License-Identifier: BSD-3-Clause
// A car of three wheels, whose lateral rows depend on each other while they are straight: steered
// wheels that no rolling agrees with slip, and the car rolls on.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <sstream>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

constexpr double kAxles = 0.8, kServoStiffness = 20, kDriveTime = 0.4;  // [m], [Nm/rad], [s]

/// A wheel behind and two in front, each steered by a servo.
std::unique_ptr<RobotSystem> Car(const std::string& friction) {
  const auto link = [](const std::string& name, double mass, double ixx, double iyy, double izz) {
    std::ostringstream text;
    text << "<link name=\"" << name << "\"><inertial><origin xyz=\"" << (name == "b" ? 0.1 : 0)
         << " 0 0\"/><mass value=\"" << mass << "\"/><inertia ixx=\"" << ixx << "\" iyy=\"" << iyy
         << "\" izz=\"" << izz << "\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>";
    return text.str();
  };
  const auto joint = [](const std::string& name, const std::string& parent,
                        const std::string& child, const char* at, const char* axis) {
    return "<joint name=\"" + name + "\" type=\"continuous\"><parent link=\"" + parent +
           "\"/><child link=\"" + child + "\"/><origin xyz=\"" + at + "\"/><axis xyz=\"" + axis +
           "\"/></joint>";
  };
  RobotTexts texts;
  texts.urdf = "<robot name=\"car\">" + link("b", 5, 0.1, 0.2, 0.2) +
               link("w0", 0.4, 0.001, 0.002, 0.001) + joint("s0", "b", "w0", "-0.4 0 0", "0 1 0");
  texts.yaml = "base: floating\nefforts:\n";
  std::string contacts = "constraints:\n";
  for (const char* k : {"0", "1", "2"}) {
    const std::string i(k);
    contacts += "  c" + i + ": {kind: rim, link: w" + i +
                ", radius: 0.1, axis: [0, 1, 0], offset: -0.1, friction: " + friction + "}\n";
    if (i == "0") continue;
    texts.urdf +=
        link("k" + i, 0.2, 0.002, 0.002, 0.002) +
        joint("steer" + i, "b", "k" + i, i == "1" ? "0.4 0.25 0" : "0.4 -0.25 0", "0 0 1") +
        link("w" + i, 0.4, 0.001, 0.002, 0.001) +
        joint("s" + i, "k" + i, "w" + i, "0 0 0", "0 1 0");
    texts.yaml += "  e" + i + ": {kind: servo, joint: steer" + i + ", input: u" + i +
                  ", stiffness: 20, damping: 1}\n";
  }
  texts.urdf += "</robot>";
  texts.yaml += contacts;
  return MakeRobot(texts);
}

int Velocity(const MechanicalSystem& system, const std::string& name) {
  const auto& names = system.description().velocities;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (names[k] == name) return system.num_positions() + static_cast<int>(k);
  }
  throw std::invalid_argument("no velocity " + name);
}

/// Rolls straight ahead at 1 m/s.
Vector Rolling(const MechanicalSystem& system) {
  Vector x = system.nominal().x;
  x.head(system.num_positions()).setZero();
  x(3) = 1;
  x.tail(system.dof()).setZero();
  for (const char* wheel : {"s0", "s1", "s2"}) {
    x(Velocity(system, wheel)) = 10;
  }
  x(Velocity(system, "base_x")) = 1;
  return x;
}

double KineticEnergy(const MechanicalSystem& system, const Vector& x) {
  Matrix mass;
  Vector force;
  system.Dynamics(x.head(system.num_positions()), x.tail(system.dof()),
                  Vector::Zero(system.num_inputs()), ContactMode(), &mass, &force);
  return 0.5 * x.tail(system.dof()).dot(mass * x.tail(system.dof()));
}

/// ∫ λ_t·T v dt of all contacts.
double FrictionWork(const MechanicalSystem& system, const Trajectory& run) {
  constexpr int kParts = 200;
  double work = 0;
  for (const Arc& arc : run.arcs) {
    ContactDynamics dynamics(system, arc.u);
    Vector x = arc.x_begin;
    ConstraintTerms terms;
    for (int k = 0; k < kParts && arc.t_end > arc.t_begin; ++k) {
      const double h = (arc.t_end - arc.t_begin) / kParts;
      arc.dense.Evaluate(arc.t_begin + (k + 0.5) * h, x.data());
      dynamics.Evaluate(x, arc.mode);
      system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
      const Vector rates = terms.jacobian * x.tail(system.dof());
      for (int i = 0; i < system.num_constraints(); ++i) {
        const Friction& friction = system.friction()[i];
        work += h * dynamics.force()
                        .segment(friction.row, friction.dimension)
                        .dot(rates.segment(friction.row, friction.dimension));
      }
    }
  }
  return work;
}

Trajectory Drive(const MechanicalSystem& system, double left, double right, double tolerance) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = tolerance;
  options.max_seconds = 20;
  return Simulate(system, Rolling(system), (Vector(2) << left, right).finished(), kDriveTime,
                  options);
}

/// What the car loses is what friction takes: it does not stop of itself.
TEST(SteeredWheels, LoseWhatFrictionTakes) {
  const auto car = Car("0.6");
  for (const double tolerance : {1e-9, 1e-11}) {
    for (const auto& [left, right] :
         {std::pair{1e-2, 0.0}, {1e-3, 1e-3}, {0.0, -1e-2}, {0.05, 0.05}}) {
      const Trajectory run = Drive(*car, left, right, tolerance);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      EXPECT_FALSE(run.transitions.empty());
      const double lost =
          KineticEnergy(*car, Rolling(*car)) - KineticEnergy(*car, run.FinalState());
      const double servos = 0.5 * kServoStiffness * (left * left + right * right);  // at most
      EXPECT_NEAR(lost, -FrictionWork(*car, run), servos + 1e-4) << left << ' ' << right;
      EXPECT_GT(run.FinalState()(Velocity(*car, "base_x")), 0.9);
      EXPECT_EQ(Outcome::kNotPiecewiseLinear, DifferentiateOutcome(*car, run).status.outcome);
    }
  }
}

/// Both wheels by the same small angle δ: the yaw rate of a car of one track, v δ / L, but for
/// what is of second order in δ, relative.
TEST(SteeredWheels, TurnAsOneTrack) {
  const auto car = Car("0.6");
  const double angle = 1e-3;
  const Trajectory run = Drive(*car, angle, angle, 1e-9);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const Vector x = run.FinalState();
  const auto& names = car->description().coordinates;
  double steered = 0;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (names[k] == "steer1") steered = x(static_cast<Eigen::Index>(k));
  }
  EXPECT_NEAR(angle, steered, 1e-5);
  const double yaw = x(car->num_positions() + 5);
  EXPECT_NEAR(steered / kAxles, yaw, 5e-3 * angle / kAxles);
}

/// No word is left to wheels that never slip.
TEST(SteeredWheels, RefusesWheelsThatNeverSlip) {
  const auto car = Car("no_slip");
  const Trajectory run = Drive(*car, 1e-2, 0, 1e-9);
  EXPECT_FALSE(run.status.ok());
  EXPECT_NE(std::string::npos, run.status.message.find("c1")) << run.status.message;
}

/// Rates that no velocity takes away stay, and do not stop the car.
TEST(SteeredWheels, ProjectionKeepsWhatIsAtOdds) {
  const auto car = Car("0.6");
  Vector x = Rolling(*car);
  const ContactMode mode = InitialMode(*car, x, car->nominal().u);
  const auto& names = car->description().coordinates;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (names[k] == "steer1") x(static_cast<Eigen::Index>(k)) = 1e-6;
  }
  const double before = KineticEnergy(*car, x);
  ASSERT_TRUE(ProjectContacts(*car, mode, &x));
  EXPECT_NEAR(before, KineticEnergy(*car, x), 1e-5);
}

}  // namespace
}  // namespace contact_flow
