// SPDX-License-Identifier: BSD-3-Clause
// (1a) and (1b) and their derivatives, for every model of the library in every mode.
#include "contact_flow/dynamics/contact_dynamics.h"

#include <gtest/gtest.h>

#include <random>

#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/mode_selection.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

constexpr double kStep = 1e-5;             // central differences: error ~h² and eps/h, both ~1e-10
constexpr double kDifferenceError = 1e-6;  // … times the size of second and third derivatives

class Dynamics : public testing::TestWithParam<std::string> {
 protected:
  Dynamics()
      : system(MakeModel(GetParam())),
        u(system->nominal().u),
        d(system->dof()),
        n(system->num_constraints()),
        dynamics(*system, u) {}
  Vector RandomState() {
    std::normal_distribution<double> normal;
    Vector x = system->nominal().x;
    for (int i = 0; i < 2 * d; ++i) x(i) += (i < d ? 0.1 : 0.5) * normal(generator);
    return x;
  }

  std::unique_ptr<MechanicalSystem> system;
  const Vector u;
  const int d, n;
  ContactDynamics dynamics;
  std::mt19937 generator{3};
};

TEST_P(Dynamics, SatisfiesTheEquationsOfMotion) {
  for (int trial = 0; trial < 10; ++trial) {
    const Vector x = RandomState();
    Matrix M;
    Vector h;
    ConstraintTerms terms;
    system->Dynamics(x.head(d), x.tail(d), u, ContactMode(), &M, &h);
    system->Constraints(x.head(d), x.tail(d), &terms);
    for (std::uint64_t bits = 0; bits < (1u << n); ++bits) {
      const ContactMode mode = ContactMode::FromBits(bits);
      dynamics.Evaluate(x, mode);
      const Vector &a = dynamics.acceleration(), &lambda = dynamics.force();
      const double scale = 1 + h.cwiseAbs().maxCoeff() + lambda.cwiseAbs().maxCoeff();
      EXPECT_LE((M * a - h - terms.jacobian.transpose() * lambda).cwiseAbs().maxCoeff(),
                1e-12 * scale);
      const Vector normal = terms.jacobian * a + terms.bias;
      for (int i = 0; i < n; ++i) {
        EXPECT_LE(mode.Contains(i) ? std::abs(normal(i)) : 0, 1e-12 * scale);
        EXPECT_EQ(0, mode.Contains(i) ? 0 : lambda(i));
      }
    }
  }
}

TEST_P(Dynamics, JacobiansAgreeWithDifferences) {
  for (int trial = 0; trial < 5; ++trial) {
    const Vector x = RandomState();
    for (std::uint64_t bits = 0; bits < (1u << n); ++bits) {
      const ContactMode mode = ContactMode::FromBits(bits);
      dynamics.Differentiate(x, mode);
      Matrix analytic(d + n, 2 * d);
      analytic << dynamics.acceleration_jacobian(), dynamics.force_jacobian();
      const double scale = std::max(1.0, analytic.cwiseAbs().maxCoeff());
      for (int j = 0; j < 2 * d; ++j) {
        const auto value = [&](double step) {
          Vector moved = x, result(d + n);
          moved(j) += step;
          dynamics.Evaluate(moved, mode);
          result << dynamics.acceleration(), dynamics.force();
          return result;
        };
        const Vector column = (value(kStep) - value(-kStep)) / (2 * kStep);
        EXPECT_LE((column - analytic.col(j)).cwiseAbs().maxCoeff(), kDifferenceError * scale)
            << "mode " << bits << " column " << j;
      }
    }
  }
}

TEST_P(Dynamics, ImpactsObeyTheComplementarityLaw) {
  for (int trial = 0; trial < 50; ++trial) {
    const Vector x = RandomState();
    const Vector q = x.head(d), v = x.tail(d);
    const ImpactResult impact = SolveImpact(*system, q, v, ContactMode::All(n));
    Matrix M;
    Vector h;
    ConstraintTerms terms;
    system->Dynamics(q, v, u, ContactMode(), &M, &h);
    system->Constraints(q, v, &terms);
    const Vector& p = impact.impulse;
    const Vector w = terms.jacobian * impact.v_plus +
                     system->restitution().cwiseProduct(terms.jacobian * v);
    EXPECT_LE((M * (impact.v_plus - v) - terms.jacobian.transpose() * p).cwiseAbs().maxCoeff(),
              1e-12);
    EXPECT_GE(p.minCoeff(), 0);
    EXPECT_GE(w.minCoeff(), -1e-12);
    EXPECT_LE(std::abs(p.dot(w)), 1e-12);
    const double before = v.dot(M * v), after = impact.v_plus.dot(M * impact.v_plus);
    EXPECT_LE(after, before + 1e-12) << "an impact makes no energy";
  }
}

/// Δ_J is linear with Δ_J² = I − (1−γ²) P, P = I − Δ at γ = 0: checked by applying it twice.
TEST_P(Dynamics, TheProjectionLawIsAReflectionUpToRestitution) {
  const double gamma = system->restitution()(0);
  for (int trial = 0; trial < 10; ++trial) {
    const Vector x = RandomState();
    const auto apply = [&](const Vector& v) {
      return SolveImpact(*system, x.head(d), v, ContactMode::All(n), ImpactLaw::kProjection).v_plus;
    };
    const Vector v = x.tail(d);
    const Vector once = apply(v), twice = apply(once);
    const Vector projected = (v - once) / (1 + gamma);  // P v
    EXPECT_LE((twice - (v - (1 - gamma * gamma) * projected)).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST_P(Dynamics, ImpactJacobianAgreesWithDifferences) {
  for (int trial = 0; trial < 10; ++trial) {
    Vector x = RandomState();
    for (int i = 0; i < n; ++i) {
      const ContactMode touching({i});
      const ImpactResult impact = SolveImpact(*system, x.head(d), x.tail(d), touching);
      if (impact.hit.Empty()) continue;  // separating: nothing to differentiate
      const Matrix DR = ImpactJacobian(*system, x.head(d), x.tail(d), impact, touching, {});
      for (int j = 0; j < 2 * d; ++j) {
        const auto value = [&](double step) {
          Vector moved = x;
          moved(j) += step;
          moved.tail(d) = SolveImpact(*system, moved.head(d), moved.tail(d), touching).v_plus;
          return moved;
        };
        const Vector column = (value(kStep) - value(-kStep)) / (2 * kStep);
        EXPECT_LE((column - DR.col(j)).cwiseAbs().maxCoeff(), kDifferenceError) << "column " << j;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllModels, Dynamics, testing::ValuesIn(ModelNames()),
                         [](const testing::TestParamInfo<std::string>& info) { return info.param; });

TEST(SelectContactMode, AVanishingForceBelongsIfItGrows) {
  // wall_and_floor at its event: λ_floor = −w (clock w = 0), which falls.
  const auto system = MakeModel("wall_and_floor");
  ContactDynamics dynamics(*system, system->nominal().u);
  Vector x = Vector::Zero(6);
  x(5) = 1;
  EXPECT_EQ(ContactMode({1}), SelectContactMode(&dynamics, x, {0, 1}, 0));
  x(5) = -1;  // the clock runs backwards: the force grows
  EXPECT_EQ(ContactMode({0, 1}), SelectContactMode(&dynamics, x, {0, 1}, 0));
}

}  // namespace
}  // namespace contact_flow
