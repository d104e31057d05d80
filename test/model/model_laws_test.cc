// SPDX-License-Identifier: BSD-3-Clause
// The laws every model obeys, checked for each model of the library at random states.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

/// Central differences with step 1e-5 have error h²·(third derivative) + eps/h ~ 1e-10, times the size of
/// the models' derivatives (≤ ~1e3 here).
constexpr double kStep = 1e-5;
constexpr double kDifferenceError = 1e-6;

class ModelLaws : public testing::TestWithParam<std::string> {
 protected:
  ModelLaws() : system(MakeModel(GetParam())), d(system->dof()), n(system->num_constraints()) {}

  /// A state near the nominal one, a different one each call.
  Vector RandomState() {
    std::normal_distribution<double> normal;
    Vector x = system->nominal().x;
    for (int i = 0; i < 2 * d; ++i) x(i) += (i < d ? 0.1 : 0.5) * normal(generator);
    return x;
  }
  Vector RandomVector(int size) {
    std::normal_distribution<double> normal;
    Vector v(size);
    for (int i = 0; i < size; ++i) v(i) = normal(generator);
    return v;
  }
  Matrix Mass(const Vector& q) const {
    Matrix M;
    Vector h;
    system->Dynamics(q, Vector::Zero(d), system->nominal().u, &M, &h);
    return M;
  }
  Vector Bias(const Vector& x) const {
    Vector h;
    system->Dynamics(x.head(d), x.tail(d), system->nominal().u, nullptr, &h);
    return h;
  }
  ConstraintTerms Terms(const Vector& x) const {
    ConstraintTerms terms;
    system->Constraints(x.head(d), x.tail(d), &terms);
    return terms;
  }
  /// r = (M q̈ − f − c v − Daᵀ λ, Da q̈ + Ḋa v).
  Vector Residual(const Vector& x, const Vector& a, const Vector& lambda) const {
    const ConstraintTerms terms = Terms(x);
    Vector r(d + n);
    r << Mass(x.head(d)) * a - Bias(x) - terms.jacobian.transpose() * lambda,
        terms.jacobian * a + terms.bias;
    return r;
  }

  std::unique_ptr<MechanicalSystem> system;
  const int d, n;
  std::mt19937 generator{7};
};

TEST_P(ModelLaws, DescriptionIsComplete) {
  const SystemDescription& names = system->description();
  EXPECT_EQ(GetParam(), names.name);
  EXPECT_FALSE(names.summary.empty());
  EXPECT_EQ(names.coordinates.size(), names.units.size());
  EXPECT_EQ(2 * d, system->nominal().x.size());
  EXPECT_EQ(system->num_inputs(), system->nominal().u.size());
  EXPECT_GT(system->nominal().duration, 0);
  for (const Parameter& parameter : names.parameters) EXPECT_FALSE(parameter.meaning.empty());
}

TEST_P(ModelLaws, MassMatrixIsSymmetricPositiveDefinite) {
  for (int k = 0; k < 20; ++k) {
    const Matrix M = Mass(RandomState().head(d));
    EXPECT_EQ(0, (M - M.transpose()).cwiseAbs().maxCoeff());
    EXPECT_EQ(Eigen::Success, M.llt().info());
  }
}

/// The power of Coriolis forces is −½ vᵀ Ṁ v: with c from M they neither make nor lose energy,
/// d/dt(½ vᵀMv) = vᵀ f along q̈ = M⁻¹(f + c v). (c v is the part of h that is quadratic in v.)
TEST_P(ModelLaws, CoriolisForcesDoNoWork) {
  if (system->HasConstantMass()) return;
  for (int k = 0; k < 20; ++k) {
    const Vector x = RandomState();
    const Vector q = x.head(d), v = x.tail(d);
    Vector still = x;
    still.tail(d).setZero();
    const Vector coriolis = Bias(x) - Bias(still);  // these models' f does not depend on v
    const Matrix rate = (Mass(q + kStep * v) - Mass(q - kStep * v)) / (2 * kStep);
    EXPECT_NEAR(-0.5 * v.dot(rate * v), v.dot(coriolis), kDifferenceError);
  }
}

TEST_P(ModelLaws, ConstraintTermsAreTheDerivativesOfTheGap) {
  for (int k = 0; k < 20; ++k) {
    const Vector x = RandomState();
    const Vector q = x.head(d), v = x.tail(d);
    const ConstraintTerms terms = Terms(x);
    for (int j = 0; j < d; ++j) {
      Vector plus = x, minus = x;
      plus(j) += kStep;
      minus(j) -= kStep;
      const Vector column = (Terms(plus).gap - Terms(minus).gap) / (2 * kStep);
      EXPECT_LE((column - terms.jacobian.col(j)).cwiseAbs().maxCoeff(), kDifferenceError);
    }
    Vector ahead = x, behind = x;
    ahead.head(d) += kStep * v;
    behind.head(d) -= kStep * v;
    const Vector rate = (Terms(ahead).jacobian - Terms(behind).jacobian) * v / (2 * kStep);
    EXPECT_LE((rate - terms.bias).cwiseAbs().maxCoeff(), kDifferenceError);
  }
}

TEST_P(ModelLaws, DynamicsResidualDerivatives) {
  for (int k = 0; k < 10; ++k) {
    const Vector x = RandomState(), a = RandomVector(d), lambda = RandomVector(n);
    ResidualJacobian jacobian;
    system->DifferentiateDynamics(x.head(d), x.tail(d), system->nominal().u, a, lambda, &jacobian);
    Matrix analytic(d + n, 2 * d);
    analytic << jacobian.momentum_q, jacobian.momentum_v, jacobian.constraint_q,
        jacobian.constraint_v;
    for (int j = 0; j < 2 * d; ++j) {
      Vector plus = x, minus = x;
      plus(j) += kStep;
      minus(j) -= kStep;
      const Vector column =
          (Residual(plus, a, lambda) - Residual(minus, a, lambda)) / (2 * kStep);
      EXPECT_LE((column - analytic.col(j)).cwiseAbs().maxCoeff(),
                kDifferenceError * std::max(1.0, analytic.cwiseAbs().maxCoeff()))
          << "column " << j;
    }
  }
}

TEST_P(ModelLaws, ImpactResidualDerivatives) {
  for (int k = 0; k < 10; ++k) {
    const Vector x = RandomState(), jump = RandomVector(d), p = RandomVector(n),
                 s = RandomVector(d);
    ResidualJacobian jacobian;
    system->DifferentiateImpact(x.head(d), jump, p, s, &jacobian);
    const auto residual = [&](const Vector& at) {
      const ConstraintTerms terms = Terms(at);
      Vector r(d + n);
      r << Mass(at.head(d)) * jump - terms.jacobian.transpose() * p, terms.jacobian * s;
      return r;
    };
    for (int j = 0; j < d; ++j) {
      Vector plus = x, minus = x;
      plus(j) += kStep;
      minus(j) -= kStep;
      Vector analytic(d + n);
      analytic << jacobian.momentum_q.col(j), jacobian.constraint_q.col(j);
      const Vector column = (residual(plus) - residual(minus)) / (2 * kStep);
      EXPECT_LE((column - analytic).cwiseAbs().maxCoeff(), kDifferenceError) << "column " << j;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllModels, ModelLaws, testing::ValuesIn(ModelNames()),
                         [](const testing::TestParamInfo<std::string>& info) { return info.param; });

}  // namespace
}  // namespace contact_flow
