// SPDX-License-Identifier: BSD-3-Clause
// The laws every model obeys, checked for each model of the library, each robot of config/robots
// and one that has every kind of joint, constraint, effort and parameter, at random states.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <random>

#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/model/row_layout.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

bool IsRobot(const std::string& name) { return name.compare(0, 6, "robot ") == 0; }

/// One on ground that moves with time, of every kind.
constexpr const char* kMoving = "robot everything_moving";

/// A model by name, or the robot of "robot NAME".
std::unique_ptr<MechanicalSystem> Make(const std::string& name,
                                       const ParameterValues& values = {}) {
  if (name == kMoving) {
    RobotDescription robot = ParseRobot(ReadRobotTexts(RobotFile(kMoving + 6)));
    robot.armature.resize(0);  // a driven clock's, in which what else is in its row would be lost
    return std::make_unique<RobotSystem>(std::move(robot), values);
  }
  if (IsRobot(name)) return LoadRobot(RobotFile(name.substr(6)), values);
  return MakeModel(name, values);
}

std::vector<std::string> AllSystems() {
  std::vector<std::string> names = ModelNames();
  for (const std::string& robot : AllRobots()) names.push_back("robot " + robot);
  for (const std::string& robot : RobotsWithFriction()) names.push_back("robot " + robot);
  names.push_back(kMoving);
  return names;
}

/// Central differences with step 1e-5 have error h²·(third derivative) + eps/h ~ 1e-10, times the
/// size of the models' derivatives (≤ ~1e3 here).
constexpr double kStep = 1e-5;
constexpr double kDifferenceError = 1e-6;

class ModelLaws : public testing::TestWithParam<std::string> {
 protected:
  ModelLaws()
      : system(Make(GetParam())),
        d(system->dof()),
        nq(system->num_positions()),
        n(system->num_rows()),
        mode(system->compliant()) {}

  /// A state near the nominal one, a different one each call.
  Vector RandomState() {
    std::normal_distribution<double> normal;
    Vector w(2 * d);
    for (int i = 0; i < 2 * d; ++i) w(i) = (i < d ? 0.1 : 0.5) * normal(generator);
    return system->Perturb(system->nominal().x, w);
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
    system->Dynamics(q, Vector::Zero(d), system->nominal().u, mode, &M, &h);
    return M;
  }
  Vector Bias(const Vector& x) const {
    Vector h;
    system->Dynamics(x.head(nq), x.tail(d), system->nominal().u, mode, nullptr, &h);
    return h;
  }
  ConstraintTerms Terms(const Vector& x) const {
    ConstraintTerms terms;
    system->Constraints(x.head(nq), x.tail(d), &terms);
    return terms;
  }
  /// r = (M q̈ − f − c v − Daᵀ λ, Da q̈ + Ḋa v).
  Vector Residual(const Vector& x, const Vector& a, const Vector& lambda) const {
    const ConstraintTerms terms = Terms(x);
    Vector r(d + n);
    r << Mass(x.head(nq)) * a - Bias(x) - terms.jacobian.transpose() * lambda,
        terms.jacobian * a + terms.bias;
    return r;
  }

  std::unique_ptr<MechanicalSystem> system;
  const int d, nq, n;
  const ContactMode mode;  // every compliant constraint pressed
  std::mt19937 generator{7};
};

TEST_P(ModelLaws, DescriptionIsComplete) {
  const SystemDescription& names = system->description();
  const std::string name = IsRobot(GetParam()) ? GetParam().substr(6) : GetParam();
  EXPECT_EQ(names.name, name.substr(0, names.name.size())) << "a robot is called as in its URDF";
  EXPECT_FALSE(names.summary.empty());
  EXPECT_EQ(names.coordinates.size(), names.units.size());
  EXPECT_EQ(nq + d, system->nominal().x.size());
  EXPECT_EQ(d, static_cast<int>(names.velocities.size()));
  EXPECT_EQ(system->num_inputs(), system->nominal().u.size());
  EXPECT_GT(system->nominal().duration, 0);
  for (const Parameter& parameter : names.parameters) EXPECT_FALSE(parameter.meaning.empty());
}

TEST_P(ModelLaws, RowsAreNormalThenBilateralThenTangential) {
  const RowLayout rows(*system);
  const ConstraintSet all = ConstraintSet::All(system->num_constraints());
  std::vector<int> listed = rows.Closed(all), expected;
  rows.AddTangential(all, &listed);
  for (int row = 0; row < n; ++row) expected.push_back(row);
  EXPECT_EQ(listed, expected) << "each row belongs to one constraint, and contacts come in order";
  const ConstraintTerms terms = Terms(RandomState());
  EXPECT_EQ(terms.gap.size(), n);
  EXPECT_EQ(terms.jacobian.rows(), n);
  EXPECT_TRUE(rows.Tangential(terms.gap).isZero(0)) << "a slip is no gap";
  Matrix together(n, d);
  together << rows.Normal(terms.jacobian), rows.Bilateral(terms.jacobian),
      rows.Tangential(terms.jacobian);
  EXPECT_EQ(together, terms.jacobian);
}

TEST_P(ModelLaws, MassMatrixIsSymmetricPositiveDefinite) {
  for (int k = 0; k < 20; ++k) {
    const Matrix M = Mass(RandomState().head(nq));
    EXPECT_EQ(0, (M - M.transpose()).cwiseAbs().maxCoeff());
    EXPECT_EQ(Eigen::Success, M.llt().info());
  }
}

/// The power of Coriolis forces is −½ vᵀ Ṁ v: with c from M they neither make nor lose energy,
/// d/dt(½ vᵀMv) = vᵀ f along q̈ = M⁻¹(f + c v). (c v is the part of h that is quadratic in v.)
TEST_P(ModelLaws, CoriolisForcesDoNoWork) {
  if (system->HasConstantMass()) return;
  if (IsRobot(GetParam())) return;  // their f depends on v: see rigid_body_laws_test.cc
  for (int k = 0; k < 20; ++k) {
    const Vector x = RandomState();
    const Vector v = x.tail(d);
    Vector still = x;
    still.tail(d).setZero();
    const Vector coriolis = Bias(x) - Bias(still);  // these models' f does not depend on v
    const Vector q = x.head(nq);
    const Matrix rate = (Mass(system->space().Retract(q, kStep * v)) -
                         Mass(system->space().Retract(q, -kStep * v))) /
                        (2 * kStep);
    EXPECT_NEAR(-0.5 * v.dot(rate * v), v.dot(coriolis), kDifferenceError);
  }
}

TEST_P(ModelLaws, ConstraintTermsAreTheDerivativesOfTheGap) {
  for (int k = 0; k < 20; ++k) {
    const Vector x = RandomState();
    const Vector v = x.tail(d);
    const ConstraintTerms terms = Terms(x);
    for (int j = 0; j < d; ++j) {
      const Vector step = kStep * Vector::Unit(2 * d, j);
      const Vector plus = system->Perturb(x, step), minus = system->Perturb(x, -step);
      const Vector column = (Terms(plus).gap - Terms(minus).gap) / (2 * kStep);
      const int gradients = n - system->num_tangential();  // T is none
      EXPECT_LE((column - terms.jacobian.col(j)).head(gradients).cwiseAbs().maxCoeff(),
                kDifferenceError);
    }
    Vector step = Vector::Zero(2 * d);
    step.head(d) = kStep * v;
    const Vector ahead = system->Perturb(x, step), behind = system->Perturb(x, -step);
    const Vector rate = (Terms(ahead).jacobian - Terms(behind).jacobian) * v / (2 * kStep);
    EXPECT_LE((rate - terms.bias).cwiseAbs().maxCoeff(), kDifferenceError);
  }
}

TEST_P(ModelLaws, DynamicsResidualDerivatives) {
  for (int k = 0; k < 10; ++k) {
    const Vector x = RandomState(), a = RandomVector(d), lambda = RandomVector(n);
    ResidualJacobian jacobian;
    system->DifferentiateDynamics(x.head(nq), x.tail(d), system->nominal().u, mode, a, lambda,
                                  &jacobian);
    Matrix analytic(d + n, 2 * d);
    analytic << jacobian.momentum_q, jacobian.momentum_v, jacobian.constraint_q,
        jacobian.constraint_v;
    for (int j = 0; j < 2 * d; ++j) {
      const Vector step = kStep * Vector::Unit(2 * d, j);
      const Vector plus = system->Perturb(x, step), minus = system->Perturb(x, -step);
      const Vector column = (Residual(plus, a, lambda) - Residual(minus, a, lambda)) / (2 * kStep);
      EXPECT_LE((column - analytic.col(j)).cwiseAbs().maxCoeff(),
                kDifferenceError * std::max(1.0, analytic.cwiseAbs().maxCoeff()))
          << "column " << j;
    }
  }
}

/// Whatever the other rows hold: here numbers that are none.
TEST_P(ModelLaws, RowsThatAreAskedForAreThoseOfAll) {
  const Vector x = RandomState(), a = RandomVector(d), u = system->nominal().u;
  const ConstraintTerms all = Terms(x);
  for (const int step : {1, 2, 3}) {
    ContactMode asked;
    for (int i = 0; i < system->num_constraints(); i += step) asked.Insert(i);
    const RowLayout layout(*system);
    std::vector<int> rows = layout.Closed(asked);
    layout.AddTangential(asked, &rows);
    Vector force = Vector::Zero(n);
    for (int row : rows) force(row) = 1 + row;
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    ConstraintTerms some{Vector::Constant(n, kNone), Matrix::Constant(n, d, kNone),
                         Vector::Constant(n, kNone)};
    system->ConstraintsOf(asked, x.head(nq), x.tail(d), &some);
    ResidualJacobian by, by_all;
    system->DifferentiateDynamicsOfMode(x.head(nq), x.tail(d), u, asked, a, force, &by);
    system->DifferentiateDynamics(x.head(nq), x.tail(d), u, asked, a, force, &by_all);
    EXPECT_EQ(by_all.momentum_q, by.momentum_q);
    EXPECT_EQ(by_all.momentum_v, by.momentum_v);
    EXPECT_EQ(by_all.momentum_u, by.momentum_u);
    for (int row : rows) {
      EXPECT_EQ(all.gap(row), some.gap(row)) << row;
      EXPECT_EQ(all.bias(row), some.bias(row)) << row;
      EXPECT_EQ(all.jacobian.row(row), some.jacobian.row(row)) << row;
      EXPECT_EQ(by_all.constraint_q.row(row), by.constraint_q.row(row)) << row;
      EXPECT_EQ(by_all.constraint_v.row(row), by.constraint_v.row(row)) << row;
    }
  }
}

TEST_P(ModelLaws, ImpactResidualDerivatives) {
  for (int k = 0; k < 10; ++k) {
    const Vector x = RandomState(), jump = RandomVector(d), p = RandomVector(n),
                 s = RandomVector(d);
    ResidualJacobian jacobian;
    system->DifferentiateImpact(x.head(nq), jump, p, s, &jacobian);
    const auto residual = [&](const Vector& at) {
      const ConstraintTerms terms = Terms(at);
      Vector r(d + n);
      r << Mass(at.head(nq)) * jump - terms.jacobian.transpose() * p, terms.jacobian * s;
      return r;
    };
    for (int j = 0; j < d; ++j) {
      const Vector step = kStep * Vector::Unit(2 * d, j);
      const Vector plus = system->Perturb(x, step), minus = system->Perturb(x, -step);
      Vector analytic(d + n);
      analytic << jacobian.momentum_q.col(j), jacobian.constraint_q.col(j);
      const Vector column = (residual(plus) - residual(minus)) / (2 * kStep);
      EXPECT_LE((column - analytic).cwiseAbs().maxCoeff(), kDifferenceError) << "column " << j;
    }
  }
}

/// Derivatives by every parameter, against systems made with other values of it.
TEST_P(ModelLaws, ParameterDerivatives) {
  const SystemDescription& names = system->description();
  const Vector x = RandomState(), a = RandomVector(d), lambda = RandomVector(n),
               s = RandomVector(d);
  for (int k = 0; k < static_cast<int>(names.parameters.size()); ++k) {
    const auto make = [&](double change) {
      ParameterValues values;
      for (const Parameter& parameter : names.parameters) values[parameter.name] = parameter.value;
      values[names.parameters[k].name] += change;
      return Make(GetParam(), values);
    };
    // One-sided, to second order, where the value sits at the end of its range.
    const auto slope = [&](const auto& f) {
      try {
        return Vector((f(*make(kStep)) - f(*make(-kStep))) / (2 * kStep));
      } catch (const std::invalid_argument&) {
      }
      try {
        return Vector((4 * f(*make(kStep)) - f(*make(2 * kStep)) - 3 * f(*make(0))) / (2 * kStep));
      } catch (const std::invalid_argument&) {
      }
      return Vector((3 * f(*make(0)) + f(*make(-2 * kStep)) - 4 * f(*make(-kStep))) / (2 * kStep));
    };
    const auto residuals = [&](const MechanicalSystem& at) {
      Matrix M;
      Vector h;
      ConstraintTerms terms;
      at.Dynamics(x.head(nq), x.tail(d), system->nominal().u, mode, &M, &h);
      at.Constraints(x.head(nq), x.tail(d), &terms);
      const Vector push = terms.jacobian.transpose() * lambda;
      Vector r(2 * d + 3 * n + at.num_constraints());
      r << M * a - h - push, terms.jacobian * a + terms.bias, M * a - push, terms.jacobian * s,
          terms.gap, at.restitution();
      return r;
    };
    ParameterJacobian dynamics, impact;
    system->DifferentiateDynamicsByParameters(x.head(nq), x.tail(d), system->nominal().u, mode, a,
                                              lambda, {k}, &dynamics);
    system->DifferentiateImpactByParameters(x.head(nq), a, lambda, s, {k}, &impact);
    Vector analytic(2 * d + 3 * n + system->num_constraints());
    analytic << dynamics.momentum, dynamics.constraint, impact.momentum, impact.constraint,
        impact.gap, impact.restitution;
    EXPECT_LE((slope(residuals) - analytic).cwiseAbs().maxCoeff(),
              kDifferenceError * std::max(1.0, analytic.cwiseAbs().maxCoeff()))
        << names.parameters[k].name;
    const auto friction = [&](const MechanicalSystem& at) {
      Vector finite = Vector::Zero(at.num_constraints());
      for (int i = 0; at.HasFriction() && i < at.num_constraints(); ++i) {
        const double coefficient = at.friction()[i].coefficient;
        if (coefficient != Friction::kNoSlip) finite(i) = coefficient;
      }
      return finite;
    };
    EXPECT_LE((slope(friction) - system->DifferentiateFriction({k})).cwiseAbs().maxCoeff(),
              kDifferenceError);
  }
}

INSTANTIATE_TEST_SUITE_P(AllModels, ModelLaws, testing::ValuesIn(AllSystems()),
                         [](const testing::TestParamInfo<std::string>& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace contact_flow
