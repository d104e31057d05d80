// SPDX-License-Identifier: BSD-3-Clause
// Terrains that are not flat: heights on a grid, from images, stairs, corners below faces; and
// ground that moves, by links that are driven.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "src/model/rigid_body/constraint/stairs.h"
#include "test/io/controlled_robots.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Make;
using test::Tight;

std::string Solid(const std::string& name, const std::string& mass) {
  return "<link name=\"" + name + "\"><inertial><mass value=\"" + mass +
         "\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>" +
         "</inertial></link>\n";
}
std::string Rail(const std::string& name, const std::string& parent, const std::string& child,
                 const std::string& axis) {
  return "<joint name=\"" + name + "\" type=\"prismatic\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/><axis xyz=\"" + axis +
         "\"/><limit lower=\"-9\" upper=\"9\" effort=\"1\" velocity=\"1\"/></joint>\n";
}
/// A point of 1 kg that slides in the x–z plane.
std::string Point() {
  return "<robot name=\"p\"><link name=\"world\"/>" + Solid("mid", "0.5") + Solid("foot", "0.5") +
         Rail("x", "world", "mid", "1 0 0") + Rail("z", "mid", "foot", "0 0 1") + "</robot>";
}

/// In these directions, all if empty, and against them. Runs at 1e-12 are good to 1e-11: quotients
/// to 1e-11/α.
void ExpectSlopes(const RobotSystem& system, double duration, std::vector<Vector> along = {},
                  const std::vector<double>& alphas = {1e-4, 1e-5, 1e-6}) {
  const int n = 2 * system.dof();
  for (int k = 0; k < n && static_cast<int>(along.size()) == k; ++k) {
    along.push_back(Vector::Unit(n, k));
  }
  const Vector x = system.nominal().x, u = system.nominal().u;
  const Trajectory run = Simulate(system, x, u, duration, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  BDerivativeOptions options;
  options.tolerance = 1e-11;
  const BDerivative B = DifferentiateOutcome(system, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (const Vector& direction : along) {
    for (const double sign : {1.0, -1.0}) {
      const Vector w = sign * direction;
      const QuotientReport report =
          CompareWithQuotients(system, x, u, duration, w, B(w), alphas, Tight(), 1e-9);
      for (const QuotientSample& sample : report.samples) {
        ASSERT_TRUE(sample.status.ok()) << sample.status.message;
        EXPECT_LE(sample.error, 1e4 * sample.alpha * (1 + B(w).norm()) + 1e-5) << w.transpose();
      }
      if (!std::isnan(report.slope)) {
        EXPECT_NEAR(1, report.slope, 0.1) << w.transpose();
      }
    }
  }
}

/// A place that is no number, as a run that fails asks for, has a height that is none.
TEST(HeightGrid, KnowsNoPlaceThatIsNone) {
  const HeightGrid grid({0, 0, 1, 1}, Matrix::Ones(3, 3));
  const double none = std::nan(""), far = 1e300;
  for (const double x : {none, far, -far}) {
    double height = 0, slope_x = 0, slope_y = 0;
    grid.At(x, 0.5, &height, &slope_x, &slope_y);
    EXPECT_EQ(std::isnan(x), std::isnan(height)) << x;
  }
}

/// The spline takes the given heights, is linear where they are, has continuous first and second
/// derivatives, and is the spline: along one direction, with natural ends, by its own equations.
TEST(HeightGrid, IsASplineOfClassTwo) {
  Matrix heights(5, 4);
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 4; ++j) heights(i, j) = std::sin(1.3 * i) + 0.4 * std::cos(2.0 * j + i);
  }
  const HeightGrid grid({-1, 2, 0.5, 0.25}, heights);
  ASSERT_EQ(5, grid.nx());
  ASSERT_EQ(4, grid.ny());
  using B = Dual<double, 2>;
  using S = Dual<B, 2>;
  struct Local {
    double h;
    Eigen::Vector2d slope;
    Eigen::Matrix2d bend;
  };
  const auto at = [&](double x, double y) {
    S X = S::Variable(B::Variable(x, 0), 0), Y = S::Variable(B::Variable(y, 1), 1), h, sx, sy;
    grid.At(X, Y, &h, &sx, &sy);
    Local local{h.value.value, {h.d[0].value, h.d[1].value}, {}};
    local.bend << h.d[0].d[0], h.d[0].d[1], h.d[1].d[0], h.d[1].d[1];
    EXPECT_NEAR(local.slope(0), sx.value.value, 1e-12);
    EXPECT_NEAR(local.slope(1), sy.value.value, 1e-12);
    return local;
  };
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 4; ++j) {
      const double x = -1 + 0.5 * i, y = 2 + 0.25 * j;
      EXPECT_NEAR(heights(i, j), at(x, y).h, 1e-13);
      for (const double e : {1e-9, -1e-9}) {  // third derivatives are of order 100
        const Local here = at(x, y), beside = at(x + e, y + e);
        EXPECT_LT((here.slope - beside.slope).norm(), 1e-6);
        EXPECT_LT((here.bend - beside.bend).norm(), 1e-5);
      }
      if (i == 0 || i == 4) {
        EXPECT_NEAR(0, at(x, y).bend(0, 0), 1e-10);
      }
    }
  }
  const Local edge = at(1, 2.3), beyond = at(1.7, 2.3);  // straight on
  EXPECT_NEAR(edge.h + 0.7 * edge.slope(0), beyond.h, 1e-12);
  // A plane is a plane.
  Matrix plane(3, 3);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) plane(i, j) = 1 + 2 * i - 3 * j;
  }
  const HeightGrid flat({0, 0, 1, 1}, plane);
  double h, sx, sy;
  for (const double x : {-2.0, 0.3, 1.9, 7.0}) {
    flat.At(x, 0.7 * x, &h, &sx, &sy);
    EXPECT_NEAR(1 + 2 * x - 2.1 * x, h, 1e-12);
    EXPECT_NEAR(2, sx, 1e-12);
    EXPECT_NEAR(-3, sy, 1e-12);
  }
}

/// Heights of a plane are the plane: the same runs, slipping with friction, too.
TEST(HeightMap, OfAPlaneIsThePlane) {
  const std::string end =
      ", friction: 0.2}}, nominal: {positions: {z: 0.3, x: 0.1}, velocities: {x: 1}}}";
  const RobotSystem plane =
      Make(Point(), "{constraints: {foot: {kind: plane, link: foot, normal: [-0.5, 0, 1]" + end);
  const RobotSystem map =
      Make(Point(),
           "{constraints: {foot: {kind: height_map, link: foot, origin: [-1, -1], step: [1, "
           "2], scale: 0.25, height: -0.5, heights: [[0, 2, 4], [0, 2, 4]]" +
               end);
  const Trajectory one = Simulate(plane, plane.nominal().x, Vector(0), 0.6, Tight());
  const Trajectory other = Simulate(map, map.nominal().x, Vector(0), 0.6, Tight());
  ASSERT_TRUE(one.status.ok() && other.status.ok()) << other.status.message;
  ASSERT_EQ(one.transitions.size(), other.transitions.size());
  EXPECT_GE(one.transitions.size(), 2u);  // lands, and turns or stops
  EXPECT_LT((one.FinalState() - other.FinalState()).norm(), 1e-10);
  ExpectSlopes(map, 0.6);
}

/// What slides on curved ground without friction keeps its energy.
TEST(HeightMap, KeepsTheEnergyOfWhatSlides) {
  const RobotSystem map = Make(
      Point(),
      "{constraints: {foot: {kind: height_map, link: foot, origin: [-1, -1], step: [0.5, 2], "
      "heights: [[0.6, 0.2, 0, 0.1, 0.7], [0.6, 0.2, 0, 0.1, 0.7]]}}, nominal: {positions: {x: "
      "-0.5, z: 0.2}}}");
  const Trajectory run = Simulate(map, map.nominal().x, Vector(0), 1, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const Vector x = run.FinalState();
  // x moves 1 kg, z half of it.
  EXPECT_NEAR(0.5 * 9.81 * 0.2, 0.5 * 9.81 * x(1) + 0.5 * x(2) * x(2) + 0.25 * x(3) * x(3), 1e-9);
  EXPECT_GT(std::abs(x(0) + 0.5), 0.1);
  const RobotSystem dropped = Make(
      Point(),
      "{constraints: {foot: {kind: height_map, link: foot, origin: [-1, -1], step: [0.5, 2], "
      "heights: [[0.6, 0.2, 0, 0.1, 0.7], [0.6, 0.2, 0, 0.1, 0.7]]}}, nominal: {positions: {x: "
      "-0.6, z: 0.4}, velocities: {x: 0.7}}}");
  ExpectSlopes(dropped, 0.6, {}, {1e-3, 1e-4, 1e-5});
}

TEST(Stairs, AreLevelOnTreadsAndRiseInRisers) {
  const double number[] = {0.05, 0.2, 0.3, 0.04, 1, 1.7, 2, 0, 5};
  const auto height = [&](double x) {
    double slope;
    const double z[] = {x, -3, 0};
    return constraint::Stairs::Height(number, z, &slope);
  };
  EXPECT_EQ(0.05, height(0.99));
  EXPECT_NEAR(0.15, height(1.02), 1e-15);
  EXPECT_NEAR(0.25, height(1.1), 1e-15);
  EXPECT_NEAR(0.45, height(1.35), 1e-15);
  EXPECT_NEAR(0.65, height(1.65), 1e-15);
  EXPECT_NEAR(0.65, height(9), 1e-15);  // no riser at 1.9
}

/// A point that is thrown bounces on a tread 0.2 m up: the height that it reaches, in closed form;
/// and it meets a riser: its speed there turns about the normal.
TEST(Stairs, AreBouncedOff) {
  const std::string stairs =
      "{constraints: {foot: {kind: stairs, link: foot, rise: 0.2, run: 0.5, riser: 0.02, first: 1, "
      "last: 1.6, restitution: 0.5}}, ";
  const RobotSystem tread =
      Make(Point(), stairs + "nominal: {positions: {x: 0.9, z: 0.7}, velocities: {x: 0.8}}}");
  const Trajectory run = Simulate(tread, tread.nominal().x, Vector(0), 0.4, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const double fall = std::sqrt(2 * 0.5 / 9.81), up = 0.5 * 9.81 * fall, rest = 0.4 - fall;
  EXPECT_NEAR(0.2 + up * rest - 0.5 * 9.81 * rest * rest, run.FinalState()(1), 1e-10);
  ExpectSlopes(tread, 0.4);
  const RobotSystem riser = Make(
      Point(), stairs + "gravity: 0, nominal: {positions: {x: 0.5, z: 0.1}, velocities: {x: 2}}}");
  // Half way up at x = 1.01 the slope is 30 (1/2)⁴ 0.2/0.02 = 18.75. M = diag(1, ½): with
  // n = (−18.75, 1), v⁺ = v − 1.5 M⁻¹ n (n·v)/(n·M⁻¹ n).
  const Trajectory hit = Simulate(riser, riser.nominal().x, Vector(0), 0.3, Tight());
  ASSERT_TRUE(hit.status.ok()) << hit.status.message;
  ASSERT_EQ(1u, hit.transitions.size());
  EXPECT_NEAR(0.51 / 2, hit.transitions[0].t, 1e-10);
  const Eigen::Vector2d n(-18.75, 1), spread(-18.75, 2), v(2, 0);
  const Eigen::Vector2d after = v - 1.5 * spread * n.dot(v) / n.dot(spread);
  EXPECT_LT((hit.FinalState().tail(2) - after).norm(), 1e-8);
  ExpectSlopes(riser, 0.3);
}

/// The corner of a box at (0.2, 0.3) below a plate that falls level and without turning: a plate is
/// met from below by the corner as a ball meets the ground.
TEST(Corners, OfTheWorldMeetFacesOfLinks) {
  const std::string urdf = "<robot name=\"p\">" + Solid("plate", "2") + "</robot>";
  const RobotSystem system =
      Make(urdf,
           "{base: planar, constraints: {edge: {kind: link_plane, link: world, point: [0.2, 0, "
           "0.3], other_link: plate, normal: [0, 0, -1]}}, nominal: {positions: {base_z: 0.8}}}");
  const Trajectory run = Simulate(system, system.nominal().x, Vector(0), 0.5, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_GE(run.transitions.size(), 1u);
  const double fall = std::sqrt(2 * 0.5 / 9.81), speed = 9.81 * fall;
  EXPECT_NEAR(fall, run.transitions[0].t, 1e-11);
  // m v − p = m v⁺, I ω = 0.2 p about y (a push upward at +x turns it by −y), plastic there.
  const double m = 2, inertia = 0.1, p = speed / (1 / m + 0.04 / inertia);
  EXPECT_NEAR(-0.2 * p / inertia, run.transitions[0].x_plus(5), 1e-9);
  ExpectSlopes(system, 0.5);
}

/// A conveyor is a link on a slide that a pd drives at its speed: a box dropped on it slips until
/// it moves along. Of finite mass, the belt gives way by the closed form of two bodies and a
/// damper: m u̇ = −μ m g on the belt's side, m_b ẇ = c (w₀ − w) − μ m g while the box is slower.
TEST(MovingGround, AConveyorIsADrivenLink) {
  const std::string urdf =
      "<robot name=\"p\"><link name=\"world\"/>" + Solid("belt", "4") + Solid("mid", "0.5") +
      Solid("box", "0.5") + Rail("belt_x", "world", "belt", "1 0 0") +
      Rail("x", "world", "mid", "1 0 0") + Rail("z", "mid", "box", "0 0 1") + "</robot>";
  const RobotSystem system = Make(
      urdf,
      "{efforts: {drive: {kind: pd, joint: belt_x, position: p, velocity: w, feed_forward: f, "
      "stiffness: 0, damping: 30}}, constraints: {box: {kind: link_plane, link: box, other_link: "
      "belt, friction: 0.4}}, nominal: {velocities: {belt_x: 1.5}, inputs: {w: 1.5}}}");
  const double mu = 0.4, g = 9.81, c = 30, mb = 4, push = mu * 0.5 * g;  // z carries 0.5 kg
  // Box: 1 kg along x, ẍ = push. Belt: w = w∞ + (1.5 − w∞) e^{−ct/mb}, w∞ = 1.5 − push/c.
  const double t = 0.4;
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, t, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_NEAR(push * t, run.FinalState()(4), 1e-10);
  const double end = 1.5 - push / c;
  EXPECT_NEAR(end + push / c * std::exp(-c / mb * t), run.FinalState()(3), 1e-10);
  const Trajectory along = Simulate(system, system.nominal().x, system.nominal().u, 3, Tight());
  ASSERT_TRUE(along.status.ok()) << along.status.message;
  EXPECT_EQ(1u, along.transitions.size());  // slip ends
  EXPECT_NEAR(along.FinalState()(3), along.FinalState()(4), 1e-9);
}

/// A shaker is a link that tracks a function of time. What rests on a table that goes down by more
/// than g lets go: with a stiff drive, where r̈ = −g.
TEST(MovingGround, AShakerIsATrackedLink) {
  const std::string urdf = "<robot name=\"p\"><link name=\"world\"/>" + Solid("table", "50") +
                           Solid("ball", "0.01") + Rail("up", "world", "table", "0 0 1") +
                           Rail("z", "world", "ball", "0 0 1") + "</robot>";
  std::string times, values;
  for (int i = 0; i <= 40; ++i) {
    times += (i > 0 ? "," : "") + std::to_string(i * 0.01);
    values += (i > 0 ? "," : "") + std::to_string(0.1 * (1 - std::cos(i * 0.1 * M_PI)) / 2);
  }
  const std::string yaml =
      "{gravity_compensation: {joints: [up]}, efforts: {shake: {kind: track, joint: up, "
      "feed_forward: f, stiffness: 5e7, damping: 1e5, reference: {periodic: true, times: [" +
      times + "], values: [" + values +
      "]}}}, constraints: {ball: {kind: link_plane, link: ball, other_link: table}}}";
  const RobotSystem system = Make(urdf, yaml);
  const Trajectory run = Simulate(system, system.nominal().x, system.nominal().u, 0.12);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  // r = 0.05 (1 − cos 10π t): r̈ = 0.05 (10π)² cos = −9.81 at cos = −0.1988. The drive follows
  // within m r̈/k = 5e-5 m; the spline's r̈ is right to h²/12 r⁗: 1 %.
  EXPECT_NEAR(std::acos(-9.81 / (0.05 * 100 * M_PI * M_PI)) / (10 * M_PI), run.transitions[0].t,
              2e-3);
  Vector both(6), rates(6), clock(6);
  both << 1, 1, 0, 0, 0, 0;
  rates << 0, 0, 0, 1, 1, 0;
  clock << 0, 0, 1, 0, 0, 0;
  ExpectSlopes(system, 0.12, {both, rates, clock});
}

TEST(Terrain, ImagesAreReadBottomUp) {
  const std::string folder = testing::TempDir();
  std::ofstream(folder + "terrain_test.pgm") << "P2\n# by hand\n3 2\n10\n5 10 0\n1 2 3\n";
  const std::string urdf =
      "<robot name=\"r\"><link name=\"body\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" "
      "iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial><collision><geometry><box "
      "size=\"0.2 0.2 0.2\"/></geometry></collision></link></robot>";
  const std::string yaml =
      "{base: floating, contacts: {ground: all}, terrain: {hall: {kind: height_map, image: "
      "terrain_test.pgm, origin: [-1, -2], step: [1, 4], low: 0.1, high: 0.6}}}";
  const RobotDescription robot = ParseRobot(urdf, YAML::Load(yaml), folder);
  ASSERT_EQ(8u, robot.constraints.size());
  const ElementParts& parts = robot.constraints[0]->parts;
  const auto height = [&](double x, double y) {
    double h, sx, sy;
    parts.heights->At(x, y, &h, &sx, &sy);
    return parts.numbers[0].value + parts.numbers[1].value * h;
  };
  EXPECT_NEAR(0.1 + 0.05 * 1, height(-1, -2), 1e-12);  // the lower row of the image
  EXPECT_NEAR(0.1 + 0.05 * 3, height(1, -2), 1e-12);
  EXPECT_NEAR(0.1 + 0.05 * 10, height(0, 2), 1e-12);
  std::ofstream(folder + "terrain_test.pgm") << "P2\n3 2\n10\n5 10 0\n1 2\n";
  try {
    ParseRobot(urdf, YAML::Load(yaml), folder);
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find("pixels are missing"));
  }
}

}  // namespace
}  // namespace contact_flow
