// SPDX-License-Identifier: BSD-3-Clause
// A body between floor and wall that no impulses in their cones stop: its impact has no solution,
// and none is told. All 16 words are tried one by one.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/systems/leaning_body.h"

namespace contact_flow {
namespace {

constexpr double kFits = 1e-8;

/// Whether impulses with these letters, o + − s of floor and wall, end an impact:
///   y = G λ + c,   rows (normal, slip) of floor and wall.
bool Fits(const Eigen::Matrix4d& G, const Eigen::Vector4d& c, const Eigen::Vector2d& mu,
          const std::string& word) {
  std::vector<Eigen::Vector4d> columns;
  std::vector<int> rows;
  for (int k = 0; k < 2; ++k) {
    if (word[k] == 'o') continue;
    Eigen::Vector4d push = Eigen::Vector4d::Unit(2 * k);
    if (word[k] != 's') push(2 * k + 1) = word[k] == '+' ? -mu(k) : mu(k);
    columns.push_back(push);
    rows.push_back(2 * k);
    if (word[k] != 's') continue;
    columns.push_back(Eigen::Vector4d::Unit(2 * k + 1));
    rows.push_back(2 * k + 1);
  }
  Eigen::Vector4d impulse = Eigen::Vector4d::Zero();
  const auto count = static_cast<Eigen::Index>(rows.size());
  if (count > 0) {
    Matrix W(4, count), system(count, count);
    Vector right(count);
    for (Eigen::Index i = 0; i < count; ++i) W.col(i) = columns[static_cast<std::size_t>(i)];
    for (Eigen::Index i = 0; i < count; ++i) {
      const int row = rows[static_cast<std::size_t>(i)];
      system.row(i) = G.row(row) * W;
      right(i) = -c(row);
    }
    impulse = W * system.completeOrthogonalDecomposition().solve(right);
  }
  const Eigen::Vector4d y = G * impulse + c;
  for (const int row : rows) {
    if (std::abs(y(row)) > kFits) return false;
  }
  for (int k = 0; k < 2; ++k) {
    const double normal = impulse(2 * k), along = impulse(2 * k + 1), slip = y(2 * k + 1);
    if (normal < -kFits || y(2 * k) < -kFits) return false;
    if (word[k] == 's' && std::abs(along) > mu(k) * normal + kFits) return false;
    if (word[k] == '+' && slip < -kFits) return false;
    if (word[k] == '-' && slip > kFits) return false;
  }
  return true;
}

bool AnyWordFits(const Eigen::Matrix4d& G, const Eigen::Vector4d& c, const Eigen::Vector2d& mu) {
  for (const char floor : {'o', '+', '-', 's'}) {
    for (const char wall : {'o', '+', '-', 's'}) {
      if (Fits(G, c, mu, {floor, wall})) return true;
    }
  }
  return false;
}

TEST(JammedImpact, IsRefused) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-0.3, 0.3), unit(0, 1);
  int jams = 0, answered = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const double least = trial % 3 == 0 ? 0.8 : trial % 3 == 1 ? 1.5 : 5;
    const Eigen::Vector2d mu(least * (1 + 2 * unit(random)), least * (1 + 2 * unit(random)));
    const double restitution = trial % 2 == 0 ? 0 : 0.35;
    const auto body = MakeSystem<test::LeaningBody>({{"floor_x", place(random)},
                                                     {"floor_z", place(random)},
                                                     {"wall_x", place(random)},
                                                     {"wall_z", place(random)},
                                                     {"floor_friction", mu(0)},
                                                     {"wall_friction", mu(1)},
                                                     {"restitution", restitution}});
    const Vector q = Vector::Zero(3);
    ConstraintTerms terms;
    body->Constraints(q, Vector::Zero(3), &terms);
    Eigen::Matrix<double, 4, 3> A;
    for (int k = 0; k < 2; ++k) {
      A.row(2 * k) = terms.jacobian.row(k);
      A.row(2 * k + 1) = terms.jacobian.row(body->friction()[k].row);
    }
    // It sticks to the wall, and falls on the floor.
    Eigen::Vector3d v = A.bottomRows<2>().fullPivLu().kernel().col(0);
    v *= (A.row(0).dot(v) > 0 ? -1 : 1) / v.norm();
    const Eigen::Vector3d inverse(0.5, 0.5, 1 / test::LeaningBody::kInertia);
    Eigen::Vector4d c = A * v;
    c(0) *= 1 + restitution;
    const bool fits = AnyWordFits(A * inverse.asDiagonal() * A.transpose(), c, mu);
    jams += !fits;
    FrictionalImpact impact;
    try {
      impact = SolveFrictionalImpact(*body, q, v, {0, 1});
    } catch (const FrictionRefusal&) {
      continue;
    }
    ++answered;
    EXPECT_TRUE(fits) << trial;
    const Eigen::Vector4d after = A * impact.result.v_plus;
    if (impact.result.impulse(0) > 1e-9) {
      EXPECT_NEAR(-restitution * A.row(0).dot(v), after(0), 1e-6) << trial;
    }
    EXPECT_GT(after(0), -1e-6) << trial;
    EXPECT_GT(after(2), -1e-6) << trial;
  }
  EXPECT_GT(jams, 20);
  EXPECT_GT(answered, 200);
  std::printf("%d of 600 jam, %d answered\n", jams, answered);
}

}  // namespace
}  // namespace contact_flow
