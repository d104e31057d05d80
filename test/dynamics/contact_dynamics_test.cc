// SPDX-License-Identifier: BSD-3-Clause
// (1a) and (1b) and their derivatives, for every model of the library in every mode.
#include "contact_flow/dynamics/contact_dynamics.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <random>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/model/model_library.h"
#include "src/dynamics/mode_selection.h"
#include "test/model/model_names.h"
#include "test/test_models.h"

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
        nq(system->num_positions()),
        n(system->num_constraints()),
        all(n + system->num_bilateral()),
        dynamics(*system, u) {}
  Vector RandomState() {
    std::normal_distribution<double> normal;
    Vector w(2 * d);
    for (int i = 0; i < 2 * d; ++i) w(i) = (i < d ? 0.1 : 0.5) * normal(generator);
    Vector x = system->Perturb(system->nominal().x, w);
    EXPECT_TRUE(!HasStateManifold(*system) || ProjectState(*system, &x));
    return x;
  }
  /// The rows of the rigid members of a mode and of the bilateral constraints.
  std::vector<int> Rows(ConstraintSet mode) const {
    std::vector<int> rows;
    for (int i : mode - system->compliant()) rows.push_back(i);
    for (int i = n; i < all; ++i) rows.push_back(i);
    return rows;
  }
  /// Assumption 3: the corners of a face depend on one another.
  bool Independent(const Vector& x, ConstraintSet mode) const {
    ConstraintTerms terms;
    system->Constraints(x.head(nq), x.tail(d), &terms);
    const std::vector<int> rows = Rows(mode);
    Matrix A(rows.size(), d);
    for (std::size_t k = 0; k < rows.size(); ++k) A.row(k) = terms.jacobian.row(rows[k]);
    Eigen::ColPivHouseholderQR<Matrix> factor(A);
    factor.setThreshold(1e-3);
    return factor.rank() == A.rows();
  }

  /// As many rigid constraints as are independent.
  ConstraintSet Touching(const Vector& x) const {
    ConstraintSet touching;
    for (int i : ConstraintSet::All(n) - system->compliant()) {
      if (Independent(x, touching.With(i))) touching.Insert(i);
    }
    return touching;
  }

  std::unique_ptr<MechanicalSystem> system;
  const Vector u;
  const int d, nq, n, all;
  ContactDynamics dynamics;
  std::mt19937 generator{3};
};

TEST_P(Dynamics, SatisfiesTheEquationsOfMotion) {
  for (int trial = 0; trial < 10; ++trial) {
    const Vector x = RandomState();
    Matrix M;
    Vector h;
    ConstraintTerms terms;
    system->Constraints(x.head(nq), x.tail(d), &terms);
    for (std::uint64_t bits = 0; bits < (1u << n); ++bits) {
      const ContactMode mode(ConstraintSet::FromBits(bits));
      if (!Independent(x, mode)) continue;
      system->Dynamics(x.head(nq), x.tail(d), u, mode, &M, &h);
      dynamics.Evaluate(x, mode);
      const Vector &a = dynamics.acceleration(), &lambda = dynamics.force();
      const double scale = 1 + h.cwiseAbs().maxCoeff() + lambda.cwiseAbs().maxCoeff();
      EXPECT_LE((M * a - h - terms.jacobian.transpose() * lambda).cwiseAbs().maxCoeff(),
                1e-12 * scale);
      const Vector normal = terms.jacobian * a + terms.bias;
      const std::vector<int> rows = Rows(mode);
      for (int i = 0; i < all; ++i) {
        const bool held = std::count(rows.begin(), rows.end(), i) > 0;
        EXPECT_LE(held ? std::abs(normal(i)) : 0, 1e-12 * scale * (1 + terms.bias.norm()));
        EXPECT_EQ(0, held ? 0 : lambda(i));
      }
    }
  }
}

/// The factors of some modes are kept: whatever was asked before, the answer is that of a new
/// object, to the bit. Also where there are more modes than are kept, and dependent ones
/// without an answer.
TEST_P(Dynamics, DoesNotDependOnTheModesBefore) {
  std::uniform_int_distribution<std::uint64_t> any(0, (std::uint64_t{1} << std::min(n, 5)) - 1);
  const auto same = [](const Matrix& a, const Matrix& b) {
    return ((a.array() == b.array()) || (a.array().isNaN() && b.array().isNaN())).all();
  };
  for (int trial = 0; trial < 60; ++trial) {
    const Vector x = RandomState();
    const ContactMode mode(ConstraintSet::FromBits(any(generator)));
    ContactDynamics fresh(*system, u);
    for (ContactDynamics* each : {&dynamics, &fresh}) each->Differentiate(x, mode);
    EXPECT_TRUE(same(dynamics.acceleration(), fresh.acceleration())) << trial;
    EXPECT_TRUE(same(dynamics.force(), fresh.force())) << trial;
    EXPECT_TRUE(same(dynamics.acceleration_jacobian(), fresh.acceleration_jacobian())) << trial;
    EXPECT_TRUE(same(dynamics.force_jacobian(), fresh.force_jacobian())) << trial;
  }
}

TEST_P(Dynamics, JacobiansAgreeWithDifferences) {
  for (int trial = 0; trial < 5; ++trial) {
    const Vector x = RandomState();
    for (std::uint64_t bits = 0; bits < (1u << n); ++bits) {
      const ContactMode mode(ConstraintSet::FromBits(bits));
      if (!Independent(x, mode)) continue;
      dynamics.Differentiate(x, mode);
      Matrix analytic(d + all, 2 * d);
      analytic << dynamics.acceleration_jacobian(), dynamics.force_jacobian();
      const double scale = std::max(1.0, analytic.cwiseAbs().maxCoeff());
      for (int j = 0; j < 2 * d; ++j) {
        const auto value = [&](double step) {
          Vector result(d + all);
          dynamics.Evaluate(system->Perturb(x, step * Vector::Unit(2 * d, j)), mode);
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
    const Vector q = x.head(nq), v = x.tail(d);
    const ConstraintSet touching = Touching(x);
    const ImpactResult impact = SolveImpact(*system, q, v, touching);
    Matrix M;
    Vector h;
    ConstraintTerms terms;
    system->Dynamics(q, v, u, ContactMode(), &M, &h);
    system->Constraints(q, v, &terms);
    const Vector& p = impact.impulse;
    Vector w = (terms.jacobian * impact.v_plus).head(n) +
               system->restitution().cwiseProduct((terms.jacobian * v).head(n));
    for (int i : ConstraintSet::All(n) - touching) w(i) = 0;
    EXPECT_LE((terms.jacobian.bottomRows(all - n) * impact.v_plus).norm(), 1e-12);
    EXPECT_LE((M * (impact.v_plus - v) - terms.jacobian.transpose() * p).cwiseAbs().maxCoeff(),
              1e-12);
    EXPECT_GE(p.head(n).minCoeff(), 0);
    EXPECT_GE(w.minCoeff(), -1e-12);
    EXPECT_LE(std::abs(p.head(n).dot(w)), 1e-12);
    const double before = v.dot(M * v), after = impact.v_plus.dot(M * impact.v_plus);
    EXPECT_LE(after, before + 1e-12) << "an impact makes no energy";
  }
}

/// Δ_J twice: Da_i Δ_J² v = γ_i² Da_i v, and v changes by M⁻¹ times a combination of normals only.
TEST_P(Dynamics, TheProjectionLawIsAReflectionUpToRestitution) {
  for (int trial = 0; trial < 10; ++trial) {
    const Vector x = RandomState();
    const ConstraintSet touching = Touching(x);
    const auto apply = [&](const Vector& v) {
      return SolveImpact(*system, x.head(nq), v, touching, ImpactLaw::kProjection).v_plus;
    };
    const Vector v = x.tail(d), twice = apply(apply(v));
    Matrix M;
    Vector h;
    ConstraintTerms terms;
    system->Dynamics(x.head(nq), v, u, ContactMode(), &M, &h);
    system->Constraints(x.head(nq), v, &terms);
    Matrix normals(touching.Size() + all - n, d);
    normals.bottomRows(all - n) = terms.jacobian.bottomRows(all - n);
    int row = 0;
    for (int i : touching) {
      const double gamma = system->restitution()(i);
      normals.row(row++) = terms.jacobian.row(i);
      EXPECT_NEAR(gamma * gamma * terms.jacobian.row(i).dot(v), terms.jacobian.row(i).dot(twice),
                  1e-11);
    }
    if (normals.rows() == 0) continue;
    const Matrix Y = M.llt().solve(normals.transpose());
    const Vector p = (normals * Y).ldlt().solve(normals * (twice - v));
    EXPECT_LE((twice - v - Y * p).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST_P(Dynamics, ImpactJacobianAgreesWithDifferences) {
  for (int trial = 0; trial < 10; ++trial) {
    const Vector x = RandomState();
    for (int i : ConstraintSet::All(n) - system->compliant()) {
      const ConstraintSet touching({i});
      const ImpactResult impact = SolveImpact(*system, x.head(nq), x.tail(d), touching);
      if (impact.hit.Empty()) continue;  // separating: nothing to differentiate
      const InverseInertia inertia(*system, x.head(nq), x.tail(d));
      const Matrix DR =
          ImpactJacobian(*system, inertia, x.head(nq), x.tail(d), impact, touching, {});
      for (int j = 0; j < 2 * d; ++j) {
        // Along what the bilateral constraints admit.
        const Vector w = ProjectAdmissible(*system, x, ContactMode(), Vector::Unit(2 * d, j));
        const auto value = [&](double step) {
          Vector moved = system->Perturb(x, step * w);
          moved.tail(d) = SolveImpact(*system, moved.head(nq), moved.tail(d), touching).v_plus;
          return system->Separation(moved, x);
        };
        const Vector column = (value(kStep) - value(-kStep)) / (2 * kStep);
        EXPECT_LE((column - DR * w).cwiseAbs().maxCoeff(), kDifferenceError) << "column " << j;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllModels, Dynamics, testing::ValuesIn(test::FrictionlessModels()),
                         [](const testing::TestParamInfo<std::string>& info) {
                           return info.param;
                         });

/// A mass on a floor that is there twice; its mass may be anything, and may count as
/// constant or not.
template <bool kConstant>
struct TwoFloors : test::UnitMasses<2, 2> {
  static constexpr bool kConstantMass = kConstant;
  static constexpr const char* kName = "two_floors";
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "y"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "same"};
  template <class P>
  struct Parameters {
    P mass = 1;
    template <class V>
    void Visit(V&& visit) {
      visit(mass, "mass", "kg", "along x", Range::kAny);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>&,
                         Eigen::Matrix<S, 2, 2>* M) {
    *M << S(p.mass), S(0.0), S(0.0), S(1.0);
  }
  template <class P, class S>
  static void Force(const P&, const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 0, 1>&, Eigen::Matrix<S, 2, 1>* f) {
    *f << S(1.0), S(-1.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    *a << q(1), q(1);
  }
};

/// Assumption 3 fails where contacts depend on one another, or where a mass
/// is not positive.
template <class Model>
void ExpectNoNumbersWhereSingular() {
  const Vector x = Vector::Zero(4);
  const auto regular = test::Make<Model>();
  ContactDynamics dynamics(regular, Vector());
  dynamics.Differentiate(x, ContactMode({0, 1}));
  EXPECT_TRUE(std::isnan(dynamics.acceleration()(1)));
  EXPECT_TRUE(std::isnan(dynamics.force()(0)) && std::isnan(dynamics.force()(1)));
  dynamics.Evaluate(x, ContactMode({1}));  // and no harm is left
  EXPECT_EQ(Eigen::Vector2d(1, 0), dynamics.acceleration());
  EXPECT_EQ(Eigen::Vector2d(0, 1), dynamics.force());
  for (const double mass : {0.0, -1.0}) {
    const auto massless = test::Make<Model>({{"mass", mass}});
    ContactDynamics singular(massless, Vector());
    for (const ContactMode& mode : {ContactMode(), ContactMode({0})}) {
      singular.Evaluate(x, mode);
      EXPECT_TRUE(std::isnan(singular.acceleration()(0)));
      EXPECT_TRUE(mode.Empty() || std::isnan(singular.force()(0)));
    }
  }
}

TEST(ContactDynamics, GivesNoNumbersWhereItIsSingular) {
  ExpectNoNumbersWhereSingular<TwoFloors<true>>();
  ExpectNoNumbersWhereSingular<TwoFloors<false>>();
}

TEST(SelectContactMode, AVanishingForceBelongsIfItGrows) {
  // wall_and_floor at its event: λ_floor = −w (clock w = 0), which falls.
  const auto system = MakeModel("wall_and_floor");
  ContactDynamics dynamics(*system, system->nominal().u);
  Vector x = Vector::Zero(6);
  x(5) = 1;
  EXPECT_EQ(ContactMode({1}), SelectContactMode(&dynamics, x, {0, 1}, {}));
  x(5) = -1;  // the clock runs backwards: the force grows
  EXPECT_EQ(ContactMode({0, 1}), SelectContactMode(&dynamics, x, {0, 1}, {}));
}

}  // namespace
}  // namespace contact_flow
