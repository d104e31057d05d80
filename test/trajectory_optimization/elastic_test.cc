// SPDX-License-Identifier: BSD-3-Clause
// Elastic collisions of two discs, one of which is driven: the optimal control problems of Hu,
// Long, Zang, E and Han (arXiv 2205.08622) and Zhong, Han, Dey and Brikis (arXiv 2305.00092), one
// collision and several, against closed forms; and gradients through elastic impacts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <functional>
#include <memory>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"

namespace contact_flow {
namespace {

constexpr double kEps = 0.01, kRadius = 0.2;  // effort and radii of the literature

/// The least of f on [a, b], which has one minimum there.
double Least(const std::function<double(double)>& f, double a, double b) {
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double c = b - golden * (b - a), d = a + golden * (b - a), fc = f(c), fd = f(d);
  while (b - a > 1e-9) {
    if (fc < fd) {
      b = d, d = c, fd = fc, c = b - golden * (b - a), fc = f(c);
    } else {
      a = c, c = d, fc = fd, d = a + golden * (b - a), fd = f(d);
    }
  }
  return f((a + b) / 2);
}

/// min ε h Σ |u_k|² + |q₂(1) − target|² with the only collision of the discs at s under the angle
/// θ, in closed form. Before it q₁(s) = q₁ + Σ a_k u_k and q̇₁(s) = Σ b_k u_k, so that the least
/// effort for given (d, v) is [d v] G⁻¹ [d v]ᵀ, G the Gram matrix of a and b; then the discs change
/// the normal parts of their velocities, and q₂ goes on to q₂ + (1 − s) (n·v) n. What bounces off
/// the wall is reflected there: the target takes its place.
struct Collision {
  Eigen::Vector2d q1, q2, target;
  int count = 0;

  double Cost(double s, double theta) const {
    const double h = 1.0 / count;
    double aa = 0, ab = 0, bb = 0;
    for (int k = 0; k * h < s; ++k) {
      const double begin = s - k * h, end = std::max(0.0, s - (k + 1) * h);
      const double a = (begin * begin - end * end) / 2, b = begin - end;
      aa += a * a, ab += a * b, bb += b * b;
    }
    const double det = aa * bb - ab * ab;
    const Eigen::Vector2d n(std::cos(theta), std::sin(theta)), t(-n.y(), n.x());
    const Eigen::Vector2d d = q2 - 2 * kRadius * n - q1;
    const double dn = d.dot(n), dt = d.dot(t), rest = 1 - s;
    // Along t the least over v, d²/aa; along n with the rest of the way.
    const double across = kEps * h * dt * dt / aa;
    const double weight = kEps * h * aa / det, goal = ab / aa * dn;  // of (v − goal)²
    const double along = kEps * h * dn * dn / aa, r = n.dot(q2 - target);
    const double v = (weight * goal - rest * r) / (weight + rest * rest);
    const double off = v - goal;
    const Eigen::Vector2d left = q2 - target + rest * v * n;
    return across + along + weight * off * off + left.squaredNorm();
  }

  /// The least over all θ from below, with s on interval k of the grid.
  double Best(int k) const {
    const double h = 1.0 / count;
    double angle = 0, least = 1e300;
    for (double at = 0.1; at < 3.1; at += 0.05) {
      const double cost = Cost((k + 0.5) * h, at);
      if (cost < least) angle = at, least = cost;
    }
    const auto over_angle = [&](double s) {
      return Least([&](double at) { return Cost(s, at); }, angle - 0.2, angle + 0.2);
    };
    return Least(over_angle, k * h + 1e-12, (k + 1) * h);
  }
  /// The same over all intervals.
  double Best() const {
    double best = 1e300;
    for (int k = count / 10; k < count; ++k) best = std::min(best, Best(k));
    return best;
  }
};

TrajectoryProblem Problem(const Collision& collision, const Eigen::Vector2d& u,
                          const Eigen::Vector2d& goal) {
  TrajectoryProblem problem;
  problem.x = Vector::Zero(8);
  problem.x.head(4) << collision.q1, collision.q2;
  for (int k = 0; k < collision.count; ++k) {
    problem.inputs.grid.push_back(static_cast<double>(k) / collision.count);
    problem.inputs.values.push_back(u);
  }
  problem.duration = 1;
  problem.effort = Eigen::Vector2d(kEps, kEps);
  problem.weight = problem.target = Vector::Zero(8);
  problem.weight.segment(2, 2).setOnes();
  problem.target.segment(2, 2) = goal;
  return problem;
}

/// `best` is the least cost with so many collisions; with more of them it may be less.
void Compare(const MechanicalSystem& system, const TrajectoryProblem& problem, double best,
             int collisions) {
  TrajectoryOptions options;
  options.neighbours = true;
  const TrajectoryOptimum found = OptimizeTrajectory(system, problem, options);
  std::printf("%zu intervals: %s, %.9f, closed form %.9f, %ld runs, %ld derivatives\n",
              problem.inputs.grid.size(), found.message.c_str(), found.cost, best,
              found.simulations, found.derivatives);
  ASSERT_TRUE(found.verdict == TrajectoryVerdict::kSmoothMinimum ||
              found.verdict == TrajectoryVerdict::kValley)
      << found.message;
  const Trajectory run = Simulate(system, found.x, found.inputs, problem.duration);
  const auto met = std::count_if(run.transitions.begin(), run.transitions.end(),
                                 [](const Transition& t) { return !t.activated.Empty(); });
  // The promise that counts as none is 1e-10 (1 + J).
  if (met == collisions) {
    EXPECT_NEAR(best, found.cost, 1e-8);
  } else {
    EXPECT_LT(found.cost, best) << met << " collisions";
  }
}

/// One disc pushes the other to the origin.
TEST(ElasticDiscs, SingleCollisionIsThatOfTheClosedForm) {
  const auto system = MakeModel("two_discs");
  for (int count : {24, 60}) {
    const Collision collision{{-1, -2}, {-1, -1}, {0, 0}, count};
    Compare(*system, Problem(collision, {0, 3}, {0, 0}), collision.Best(), 1);
  }
}

/// … and over the wall: the second disc bounces off it. Beginning with a run in which the first
/// disc then gives way, as in the closed form; where they meet once more there are other minima.
TEST(ElasticDiscs, CollisionWithTheWallIsThatOfTheClosedForm) {
  const auto system = MakeModel("two_discs", {{"wall", 1.0}});
  for (int count : {24, 60}) {
    const Collision collision{{0.25, -0.3}, {-0.5, 0.6}, {0, 2 * (1 - kRadius)}, count};
    TrajectoryProblem problem = Problem(collision, {-3.5, 3}, {0, 0});
    const double best = collision.Best();
    for (int k = 0; k < count; ++k) {
      if (5 * k > 3 * count) problem.inputs.values[static_cast<std::size_t>(k)] << 4, -6;
    }
    Compare(*system, problem, best, 2);
  }
}

/// Where the coast of two discs on a line ends: piecewise parabolas that exchange their speeds
/// when they meet, and turn at the wall; in complex numbers, so that i·1e-30 in an input gives the
/// derivative to rounding.
using Number = std::complex<double>;

struct OnALine {
  Number y1, y2, v1, v2;
  int collisions = 0, bounces = 0;

  void Advance(Number t, Number u) {
    y1 += t * v1 + t * t * u / 2.0;
    y2 += t * v2;
    v1 += t * u;
  }
  /// The earliest root > 0 of c + b t + a t², c ≥ 0 shrinking; ∞ without.
  static Number Root(Number c, Number b, Number a) {
    Number best = 1e300;
    const Number root = std::sqrt(b * b - 4.0 * a * c);
    if (std::abs(root.imag()) > 1e-12) return best;  // they never meet
    for (const Number& t : {2.0 * c / (-b + root), 2.0 * c / (-b - root)}) {
      if (t.real() > 1e-9 && t.real() < best.real()) best = t;
    }
    return best;
  }
  void Hold(Number u, double length, double wall) {
    Number left = length;
    for (;;) {
      const Number meet = Root(y2 - y1 - 2 * kRadius, v2 - v1, -u / 2.0);
      const Number turn = v2.real() > 0 ? (wall - kRadius - y2) / v2 : Number(1e300);
      const bool first = meet.real() < turn.real();
      const Number next = first ? meet : turn;
      if (next.real() >= left.real()) break;
      Advance(next, u);
      left -= next;
      if (first) {
        std::swap(v1, v2);
        ++collisions;
      } else {
        v2 = -v2;
        ++bounces;
      }
    }
    Advance(left, u);
  }
};

/// Pushed once and twice, with the wall between: gradients of |(y₁, y₂, ẏ₁, ẏ₂)(T) − goal|² by
/// every input.
TEST(ElasticDiscs, GradientsThroughCollisionsAreThoseOfTheClosedForm) {
  constexpr double kWall = 1;
  const auto system = MakeModel("two_discs", {{"wall", kWall}});
  int twice = 0, once = 0;
  for (double push : {1.5, 4.0, 6.0, 9.0}) {
    TrajectoryProblem problem;
    problem.x = Vector::Zero(8);
    problem.x.head(4) << 0.3, -0.6, 0.3, 0.3;
    constexpr int kCount = 9;
    std::vector<double> u;
    for (int k = 0; k < kCount; ++k) {
      u.push_back(push * (1 - 0.07 * k));
      problem.inputs.grid.push_back(0.13 * k);
      problem.inputs.values.push_back(Eigen::Vector2d(0, u.back()));
    }
    problem.duration = 0.13 * kCount;
    problem.effort = Vector::Zero(2);
    problem.weight = Vector::Zero(8);
    problem.target = Vector::Constant(8, 0.1);
    for (int i : {1, 3, 5, 7}) problem.weight(i) = 1 + i;
    const auto cost = [&](int which, OnALine* line) {
      *line = {-0.6, 0.3, 0, 0};
      for (int k = 0; k < kCount; ++k) {
        line->Hold(Number(u[static_cast<std::size_t>(k)], k == which ? 1e-30 : 0), 0.13, kWall);
      }
      const Number off[] = {line->y1 - 0.1, line->y2 - 0.1, line->v1 - 0.1, line->v2 - 0.1};
      return 2.0 * off[0] * off[0] + 4.0 * off[1] * off[1] + 6.0 * off[2] * off[2] +
             8.0 * off[3] * off[3];
    };
    const Unknowns unknowns(*system, problem);
    const PieceModels models = MakePieceModels(unknowns, unknowns.Start());
    ASSERT_TRUE(models.status.ok()) << push << models.status.message;
    ASSERT_EQ(1u, models.pieces.size());
    OnALine line;
    EXPECT_NEAR(cost(-1, &line).real(), models.cost, 1e-9 * (1 + models.cost)) << push;
    once += line.collisions == 1;
    twice += line.collisions >= 2 && line.bounces >= 1;
    for (int k = 0; k < kCount; ++k) {
      const double slope = cost(k, &line).imag() / 1e-30;
      const int place = unknowns.Input(static_cast<std::size_t>(k), 1);
      EXPECT_NEAR(slope, models.pieces.front().gradient(place), 1e-8 * (1 + std::abs(slope)))
          << push << ", input " << k;
    }
  }
  EXPECT_GE(once, 1);
  EXPECT_GE(twice, 1);
}

/// Both discs bounce off the wall at the same instant, at which the input changes, too: an elastic
/// corner with a right angle. With z = y before and z = 2 w − y behind the touchdown at t_c, z̈ = u
/// before and −u behind it, so that
///   δy(T) = −δz(T) − 2 u_c (T − t_c) δt_c,   δt_c = −δz(t_c)/ż,
/// with the input u_c of before or behind the change, whichever the touchdown moves into.
TEST(ElasticDiscs, GradientsThroughACornerAreThoseOfTheReflection) {
  const auto system = MakeModel("two_discs", {{"wall", 1.0}});
  TrajectoryProblem problem;
  problem.x = Vector::Zero(8);
  // Both are at 0.8 at t = 0.4, with ẏ₁ = 1.8 and ẏ₂ = 1.
  problem.x << -1, 0.24, 1, 0.4, 0, 1, 0, 1;
  problem.inputs.grid = {0, 0.2, 0.4, 0.6};
  const double u[] = {2, 2, -1, 0.5};
  for (double value : u) problem.inputs.values.push_back(Eigen::Vector2d(0, value));
  problem.duration = 0.8;
  problem.choose_initial = {1, 3, 5, 7};
  problem.effort = Vector::Zero(2);
  problem.weight = problem.target = Vector::Zero(8);
  problem.weight(1) = problem.weight(3) = 1;
  const Unknowns unknowns(*system, problem);
  const PieceModels models = MakePieceModels(unknowns, unknowns.Start());
  ASSERT_TRUE(models.status.ok()) << models.status.message;
  ASSERT_EQ(6u, models.pieces.size());  // three events
  const double y1 = 0.8 - 0.4 * 1.8 + (u[2] * (0.16 - 0.04) + u[3] * 0.04) / 2, y2 = 0.8 - 0.4;
  EXPECT_NEAR(y1 * y1 + y2 * y2, models.cost, 1e-9);
  // δz(T) and δz(t_c) by u_0 … u_3, y₁, ẏ₁.
  const double at_end[] = {0.14, 0.1, -0.06, -0.02, 1, 0.8};
  const double at_wall[] = {0.06, 0.02, 0, 0, 1, 0.4};
  for (const PieceModel& piece : models.pieces) {
    const bool before = piece.label.find("first wall") < piece.label.find("input change");
    const double u_c = before ? u[1] : u[2];
    for (int i = 0; i < 6; ++i) {
      const int place =
          i < 4 ? unknowns.Input(static_cast<std::size_t>(i), 1) : unknowns.Initial(i == 4 ? 0 : 2);
      const double slope = -at_end[i] + 2 * u_c * 0.4 * at_wall[i] / 1.8;
      // The coincidence is met to 1e-12, the tangents are right to 1e-11.
      EXPECT_NEAR(2 * y1 * slope, piece.gradient(place), 1e-9) << piece.label << i;
    }
    EXPECT_NEAR(-2 * y2, piece.gradient(unknowns.Initial(1)), 1e-9) << piece.label;
    EXPECT_NEAR(-2 * y2 * 0.8, piece.gradient(unknowns.Initial(3)), 1e-9) << piece.label;
  }
}

}  // namespace
}  // namespace contact_flow
