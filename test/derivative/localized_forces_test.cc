// SPDX-License-Identifier: BSD-3-Clause
// Tangents through forces that act on a small part of the way, against the variational equation
// integrated together with the state by Boost (exact_tangents.h).
#include "test/derivative/localized_forces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/variation.h"
#include "contact_flow/flow/simulate.h"
#include "test/derivative/exact_tangents.h"

namespace contact_flow {
namespace {

using test::LocalizedForces;
using Term = LocalizedForces::Term;

/// Steps of the exact integration: fine enough for a gust of half a percent of the way.
constexpr int kExactSteps = 2000;

Vector Numbers(std::initializer_list<double> numbers) {
  return Eigen::Map<const Vector>(numbers.begin(), static_cast<Eigen::Index>(numbers.size()));
}

/// f = −9.81 and one force along coordinate 0 that depends on `along` x.
LocalizedForces Falling(int d, const Term& term) {
  return LocalizedForces(ConfigurationSpace(d), -9.81 * Vector::Unit(d, 0), Matrix::Zero(d, 2 * d),
                         {term});
}

/// f = 9.81 (e^(−z/s) − 1).
LocalizedForces SoftGround() {
  Term ground;
  ground.gust = false;
  ground.amplitude = 9.81;
  ground.width = 0.01;
  ground.push = Vector::Ones(1);
  ground.along = Numbers({1, 0}).transpose();
  ground.centre = Vector::Zero(1);
  return Falling(1, ground);
}

Term Gust(int d, int coordinate, double amplitude, double width, double centre) {
  Term gust;
  gust.amplitude = amplitude;
  gust.width = width;
  gust.push = Vector::Unit(d, 0);
  gust.along = Vector::Unit(2 * d, coordinate).transpose();
  gust.centre = Numbers({centre});
  return gust;
}

struct Answer {
  Status status;
  double state_error = 0;
  double error = 0;  ///< of Φ relative to the largest entry, of tangents and parameters each
  VariationStatistics statistics;
};

Answer Compare(const LocalizedForces& system, const Vector& x, double duration,
               const SimulateOptions& options = {}) {
  Answer answer;
  const Trajectory run = Simulate(system, x, Vector(0), duration, options);
  EXPECT_TRUE(run.status.ok()) << run.status.message;
  BDerivativeOptions derivative;
  const int n = 2 * system.dof();
  const int k = static_cast<int>(system.description().parameters.size());
  for (int p = 0; p < k; ++p) derivative.variables.parameters.push_back(p);
  const BDerivative B = DifferentiateOutcome(system, run, derivative);
  answer.status = B.status;
  const test::ExactTangents exact = test::IntegrateTangents(system, x, duration, kExactSteps);
  answer.state_error = (run.FinalState() - exact.x).cwiseAbs().maxCoeff();
  if (!B.status.ok()) return answer;
  ContactDynamics dynamics(system, Vector(0), derivative.variables);
  PropagateArc(&dynamics, run.arcs.front(), derivative.tolerance, &answer.statistics);
  const Matrix difference = B.arcs.front().topRows(n) - exact.phi;
  answer.error = difference.leftCols(n).cwiseAbs().maxCoeff() /
                 std::max(1.0, exact.phi.leftCols(n).cwiseAbs().maxCoeff());
  if (k > 0) {
    answer.error =
        std::max(answer.error, difference.rightCols(k).cwiseAbs().maxCoeff() /
                                   std::max(1.0, exact.phi.rightCols(k).cwiseAbs().maxCoeff()));
  }
  return answer;
}

/// Run and tangents keep 1e-9 for each step; some forty steps, and the force's slope, which turns
/// errors of the state of 1e-9 into errors of 1e-9·(path/width) of the Jacobian, up to a hundred
/// times as much.
constexpr double kAllowed = 1e-6;

/// The example of the issue: B(z) was (1, 0) and by the width 0.
TEST(LocalizedForces, AnExponentialGround) {
  const LocalizedForces ground = SoftGround();
  const Vector x = Numbers({1, 0});
  for (double max_step : {0.0, 1e-3}) {
    SimulateOptions options;
    options.max_step = max_step;
    const Trajectory run = Simulate(ground, x, Vector(0), 0.95, options);
    BDerivativeOptions by_width;
    by_width.variables.parameters = {1};
    const BDerivative B = DifferentiateOutcome(ground, run, by_width);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    const Vector by_z = B(Vector::Unit(3, 0)), by_s = B(Vector::Unit(3, 2));
    EXPECT_NEAR(1.087, by_z(0), 5e-4);
    EXPECT_NEAR(4.342, by_z(1), 5e-4);
    EXPECT_NEAR(0.44, by_s(0), 5e-3);
    EXPECT_NEAR(22.0, by_s(1), 5e-2);
    EXPECT_LE(Compare(ground, x, 0.95, options).error, kAllowed);
  }
}

/// One metre of fall: widths in parts of the way, wherever the gust blows. Where the steps of the
/// run themselves leap over it, neither state nor tangents know of it.
TEST(LocalizedForces, GustsInSpace) {
  for (double width : {0.005, 0.01, 0.03, 0.1}) {
    for (double centre : {0.2, 0.37, 0.5, 0.83}) {
      SimulateOptions options;
      options.max_step = 2 * width;  // which the run needs to find them from free fall
      const Answer answer =
          Compare(Falling(1, Gust(1, 0, 30, width, centre)), Numbers({1, 0}), 0.45, options);
      ASSERT_LE(answer.state_error, 1e-8) << width << " at " << centre;
      EXPECT_TRUE(answer.status.ok()) << answer.status.message;
      EXPECT_LE(answer.error, kAllowed) << width << " at " << centre;
    }
  }
}

TEST(LocalizedForces, GustsInTime) {
  for (double width : {0.005, 0.01, 0.03, 0.1}) {
    for (double centre : {0.2, 0.5, 0.83}) {
      SimulateOptions options;
      options.max_step = 2 * width;
      const Answer answer = Compare(Falling(2, Gust(2, 1, 30, 0.6 * width, 0.6 * centre)),
                                    Numbers({1, 0, 0, 1}), 0.6, options);
      ASSERT_LE(answer.state_error, 1e-8) << width << " at " << centre;
      EXPECT_TRUE(answer.status.ok()) << answer.status.message;
      EXPECT_LE(answer.error, kAllowed) << width << " at " << centre;
    }
  }
}

/// A throw that grazes a round bump, with its top beside the path.
TEST(LocalizedForces, ABumpThatThePathGrazes) {
  for (double width : {0.005, 0.01, 0.03, 0.1}) {
    for (double beside : {0.0, 0.7, 1.5}) {
      Term bump = Gust(2, 0, 40, width, 0);
      bump.push = Numbers({std::cos(0.3), std::sin(0.3)});
      bump.along = Matrix::Identity(2, 4);
      bump.centre = Numbers({0, 1 + beside * width});  // the top of the throw
      const LocalizedForces system(ConfigurationSpace(2), Numbers({-9.81, 0}), Matrix::Zero(2, 4),
                                   {bump});
      SimulateOptions options;
      options.max_step = 2 * width;
      const Answer answer = Compare(system, Numbers({-9.81 / 8, 0, 9.81 / 2, 2}), 0.9, options);
      ASSERT_LE(answer.state_error, 1e-8) << width << ", " << beside;
      EXPECT_TRUE(answer.status.ok()) << answer.status.message;
      EXPECT_LE(answer.error, kAllowed) << width << ", " << beside;
    }
  }
}

/// In free flight with stiff springs at rest, the state is a polynomial and the tangents are not;
/// a gust comes on top.
TEST(LocalizedForces, StiffSpringsAtRestInFreeFlight) {
  for (double stiffness : {1e2, 1e4}) {
    Matrix L = Matrix::Zero(3, 6);  // two equal masses on a spring, and a clock
    L.topLeftCorner(2, 2) << -stiffness, stiffness, stiffness, -stiffness;
    for (double amplitude : {0.0, 5.0}) {
      Term gust = Gust(3, 2, amplitude, 0.02, 0.31);
      gust.push = Numbers({1, 1, 0});
      const LocalizedForces system(ConfigurationSpace(3), Numbers({-9.81, -9.81, 0}), L, {gust});
      SimulateOptions options;
      options.max_step = 0.02;
      const Answer answer = Compare(system, Numbers({1, 1, 0, 0, 0, 1}), 0.7, options);
      ASSERT_LE(answer.state_error, 1e-8);
      EXPECT_TRUE(answer.status.ok()) << answer.status.message;
      EXPECT_LE(answer.error, kAllowed) << stiffness << ", " << amplitude;
    }
  }
}

/// A force that is narrower than all that the steps of a run look at is found with max_step: the
/// right number, or a refusal that names the arc where a sample of the Jacobian met it.
TEST(LocalizedForces, AForceThatTheRunLeapsOverIsFoundWithMaxStep) {
  // With d = 1 the run falls in three steps; the gust covers a point where tangents look, z(t).
  int refused = 0, wrong = 0;
  for (int k = 1; k < 40; ++k) {
    const double t = 0.45 * k / 40, z = 1 - 0.5 * 9.81 * t * t;
    const LocalizedForces system = Falling(1, Gust(1, 0, 300, 0.004, z));
    SimulateOptions options;
    options.max_step = 0.45 / 500;
    const Answer answer = Compare(system, Numbers({1, 0}), 0.45, options);
    if (!answer.status.ok()) {
      ++refused;
      EXPECT_EQ(Outcome::kNotDifferentiable, answer.status.outcome);
      EXPECT_NE(std::string::npos, answer.status.message.find("t = 0 s to 0.45 s"))
          << answer.status.message;
      EXPECT_GT(answer.state_error, 1e-6);
    } else if (answer.state_error <= 1e-7) {
      EXPECT_LE(answer.error, 1e-5) << "gust at " << z;
    } else {
      ++wrong;  // run and tangents agree on a motion without the gust
    }
  }
  std::printf("of 39 gusts %d refused, %d missed by run and tangents\n", refused, wrong);
  EXPECT_EQ(0, wrong);
  EXPECT_LE(refused, 4);
}

/// A random system on one of the three kinds of configuration space, with one or two gusts on its
/// way, in positions or velocities, and perhaps stiff springs.
struct RandomGusts {
  explicit RandomGusts(int seed) {
    std::mt19937 generator(static_cast<unsigned>(seed));
    const auto uniform = [&](double a, double b) {
      return std::uniform_real_distribution<double>(a, b)(generator);
    };
    ConfigurationSpace space;
    if (seed % 3 == 0) space.Append(ConfigurationSpace::Factor::kLine, 1 + seed / 3 % 3);
    if (seed % 3 == 1) {
      space.Append(ConfigurationSpace::Factor::kLine);
      space.Append(ConfigurationSpace::Factor::kCircle, 1 + seed / 3 % 2);
    }
    if (seed % 3 == 2) {
      if (seed / 3 % 2 == 1) space.Append(ConfigurationSpace::Factor::kLine, 3);
      space.Append(ConfigurationSpace::Factor::kRotation);
    }
    const int nq = space.num_positions(), d = space.dof();
    x = Vector::NullaryExpr(nq + d, [&] { return uniform(-1, 1); });
    x.tail(d) *= 2;
    space.Normalize(x.data());
    duration = uniform(0.3, 1.5);
    Matrix L = Matrix::Zero(d, nq + d);
    if (seed % 2 == 0) L = Matrix::NullaryExpr(d, nq + d, [&] { return uniform(-1, 1); });
    if (seed % 5 == 0 && space.IsFlat()) {
      const double stiffness = std::pow(10, uniform(1, 4));
      for (int i = 0; i < d; ++i) {
        L(i, i) -= stiffness;
        L(i, nq + i) -= 2 * std::sqrt(stiffness) * uniform(0, 0.3);
      }
    }
    const Vector g = Vector::NullaryExpr(d, [&] { return uniform(-5, 5); });
    const Trajectory way = Simulate(LocalizedForces(space, g, L, {}), x, Vector(0), duration);
    std::vector<Term> gusts;
    for (int b = 0; b < 1 + seed / 7 % 2; ++b) {
      const Vector there = way.State(uniform(0.05, 0.95) * duration);
      Term gust;
      const int r = 1 + seed / 11 % 2;
      gust.along = Matrix::NullaryExpr(r, nq + d, [&] { return uniform(-1, 1); });
      if (seed % 4 != 0) gust.along.rightCols(d).setZero();
      Vector rate = Vector::Zero(nq + d);
      space.Rate(there.data(), there.data() + nq, rate.data());
      const double part = std::pow(10, uniform(-2.3, -0.7));
      gust.width = ((gust.along * rate).norm() + 1e-3) * duration * part;
      gust.centre = gust.along * there;
      gust.centre += gust.width * Vector::NullaryExpr(r, [&] { return uniform(-1, 1); });
      gust.push = Vector::NullaryExpr(d, [&] { return uniform(-1, 1); });
      gust.amplitude = 0.3 * std::pow(10, uniform(-1, 1.5)) / std::min(1.0, 10 * part);
      gusts.push_back(gust);
    }
    system = std::make_unique<LocalizedForces>(space, g, L, gusts);
  }

  std::unique_ptr<LocalizedForces> system;
  Vector x;
  double duration = 0;
};

/// Where the run is right its tangents are. The estimate of their error is calibrated: the error is
/// less in 99 of 100, and rarely a hundred times less.
TEST(LocalizedForces, RandomOnes) {
  constexpr int kSeeds = 240;
  int answered = 0, lost = 0, refused = 0, above = 0, far_below = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const RandomGusts random(seed);
    SimulateOptions options;
    options.max_step = random.duration / 50;  // finds what is 2 % of the way
    const Answer answer = Compare(*random.system, random.x, random.duration, options);
    if (answer.state_error > 1e-6) {
      ++lost;  // the run itself
      continue;
    }
    if (!answer.status.ok()) {
      ++refused;
      std::printf("seed %d: %s\n", seed, answer.status.message.c_str());
      continue;
    }
    ++answered;
    EXPECT_LE(answer.error, 1e-4) << "seed " << seed;
    above += answer.error > answer.statistics.error_estimate;
    far_below += answer.error < 0.01 * answer.statistics.error_estimate;
  }
  std::printf(
      "%d seeds: %d answered, %d refused, %d lost by the run; estimate below the error in "
      "%d, above a hundred times in %d\n",
      kSeeds, answered, refused, lost, above, far_below);
  EXPECT_GT(answered, kSeeds * 8 / 10);
  EXPECT_LE(refused, kSeeds / 100);
}

/// A ground that is nothing here, beyond numbers: the force is 0 and its slope, 0 · ∞, is none. The
/// tangents are refused for that, and end.
TEST(LocalizedForces, WithASlopeThatIsNoNumberAreRefused) {
  Term ground;
  ground.gust = false;
  ground.amplitude = 1e300;
  ground.width = 1e-300;
  ground.push = Vector::Ones(1);
  ground.along = Matrix(Eigen::RowVector2d(1, 0));
  ground.centre = Vector::Constant(1, -1);
  const LocalizedForces system(ConfigurationSpace(1), Vector::Zero(1), Matrix::Zero(1, 2),
                               {ground});
  const Trajectory run = Simulate(system, Vector::Zero(2), Vector(0), 1);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const Status status = DifferentiateOutcome(system, run).status;
  EXPECT_EQ(Outcome::kNotDifferentiable, status.outcome);
  EXPECT_NE(std::string::npos, status.message.find("that of 'v' by 'v'")) << status.message;
}

}  // namespace
}  // namespace contact_flow
