// SPDX-License-Identifier: BSD-3-Clause
#include "src/derivative/collocation_rule.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

namespace contact_flow {
namespace {

/// R(z), what a step makes of ẏ = λy, z = hλ: 1 + z bᵀ (I − z a)⁻¹ 1.
double Step(const CollocationRule& rule, double z) {
  const int s = rule.stages;
  const Matrix left = Matrix::Identity(s, s) - z * rule.a;
  return 1 + z * rule.b.dot(left.partialPivLu().solve(Vector::Ones(s)));
}

const CollocationRule& Rule(bool stiff, int stages) {
  return stiff ? CollocationRule::RadauIIA(stages) : CollocationRule::GaussLegendre(stages);
}

TEST(CollocationRule, IntegratesPolynomialsOfItsOrder) {
  for (const bool stiff : {false, true}) {
    for (int s = CollocationRule::kMinStages; s <= CollocationRule::kMaxStages; ++s) {
      const CollocationRule& rule = Rule(stiff, s);
      ASSERT_EQ(stiff ? 2 * s : 2 * s + 1, rule.power);
      for (int k = 0; k + 1 < rule.power; ++k) {
        EXPECT_NEAR(1.0 / (k + 1), rule.b.dot(rule.c.array().pow(k).matrix()), 1e-14) << s;
      }
    }
  }
}

TEST(CollocationRule, HasTheErrorItStates) {
  for (const bool stiff : {false, true}) {
    for (int s = 2; s <= 3; ++s) {
      const CollocationRule& rule = Rule(stiff, s);
      const double z = 0.05, error = std::abs(std::exp(z) - Step(rule, z));
      EXPECT_NEAR(1, error / (rule.error * std::pow(z, rule.power)), 0.1) << stiff << s;
    }
  }
}

/// What decays fast is gone behind a step of Radau IIA; one of Gauss and Legendre turns its sign.
TEST(CollocationRule, ForDecaysLeavesNothingOfThem) {
  for (int s = CollocationRule::kMinStages; s <= CollocationRule::kMaxStages; ++s) {
    EXPECT_LT(std::abs(Step(CollocationRule::RadauIIA(s), -1e6)), s * s * 2e-6) << s;
    EXPECT_GT(std::abs(Step(CollocationRule::GaussLegendre(s), -1e6)), 0.99) << s;
    EXPECT_NEAR(1, CollocationRule::RadauIIA(s).at_end(s - 1), 1e-14);
  }
}

}  // namespace
}  // namespace contact_flow
