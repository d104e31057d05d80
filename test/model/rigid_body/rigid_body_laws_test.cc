// SPDX-License-Identifier: BSD-3-Clause
// The laws of the rigid-body algorithms, on random trees with every kind of joint. Derivatives are
// held against complex steps of 1e-30, which have no error but rounding: the tolerances are 1e-11
// of the largest element, for some 1e3 operations on numbers that exceed it at most tenfold.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <complex>

#include "contact_flow/model/rigid_body/inverse_dynamics_jacobian.h"
#include "src/model/rigid_body/point_jacobian.h"
#include "src/model/rigid_body/tree_factor.h"
#include "test/model/rigid_body/random_tree.h"

namespace contact_flow {
namespace {

using Complex = std::complex<double>;
using ComplexVector = Eigen::VectorXcd;
constexpr double kComplexStep = 1e-30;
constexpr double kRounding = 1e-11;

struct PointForce {
  int body;
  Vec3<double> local, force;
};

template <class S>
void Update(const RigidBodyTree& tree, const S* q, const S* v, TreeState<S>* state) {
  UpdatePositions(tree, q, state);
  UpdateVelocities(tree, v, state);
  UpdateInertias(tree, state);
}

/// τ of inverse dynamics under forces on points, and the points' accelerations below it.
template <class S>
Eigen::Matrix<S, Eigen::Dynamic, 1> Outcome(const RigidBodyTree& tree,
                                            const Eigen::Matrix<S, Eigen::Dynamic, 1>& q,
                                            const Eigen::Matrix<S, Eigen::Dynamic, 1>& v,
                                            const Vector& vdot,
                                            const std::vector<PointForce>& forces) {
  TreeState<S> state(tree);
  const Vec3<S> gravity = tree.gravity().cast<S>();
  Update(tree, q.data(), v.data(), &state);
  std::vector<PointForces<S>> external(tree.num_bodies());
  for (PointForces<S>& sum : external) sum.SetZero();
  for (const PointForce& f : forces) {
    const Vec3<S> r =
        PointPosition<S>(state, f.body, f.local.cast<S>()) - state.body[f.body].reference;
    external[f.body].Add(r, f.force.cast<S>());
  }
  const Eigen::Matrix<S, Eigen::Dynamic, 1> a = vdot.cast<S>();
  const int n = tree.dof(), m = static_cast<int>(forces.size());
  Eigen::Matrix<S, Eigen::Dynamic, 1> outcome(n + 9 * m);
  InverseDynamics(tree, gravity, a.data(), external.data(), &state, outcome.data());
  for (int k = 0; k < m; ++k) {
    const PointMotion<S> motion =
        MovePoint<S>(state, gravity, forces[k].body, forces[k].local.cast<S>());
    outcome.segment(n + 9 * k, 9) << motion.position, motion.velocity, motion.acceleration;
  }
  return outcome;
}

class RigidBodyLaws : public testing::TestWithParam<int> {
 protected:
  RigidBodyLaws()
      : random(GetParam()),
        tree(random.Tree(2 + GetParam() % 9, GetParam() % 2 == 0)),
        n(tree.dof()),
        q(random.Positions(tree)),
        v(random.NormalVector(n)),
        vdot(random.NormalVector(n)) {
    for (int k = 0; k < 3; ++k) {
      forces.push_back({random.Whole(0, tree.num_bodies() - 1), 0.2 * random.NormalVector(3),
                        random.NormalVector(3)});
    }
  }
  Matrix Mass(const Vector& at) {
    TreeState<double> state(tree);
    UpdatePositions(tree, at.data(), &state);
    UpdateInertias(tree, &state);
    Matrix M(n, n);
    MassMatrix(tree, &state, M.data());
    return M;
  }
  /// Ṁ along v.
  Matrix MassRate() {
    ComplexVector Q = q.cast<Complex>();
    Q += PositionRate<Complex>(tree, Q, Complex(0, kComplexStep) * v.cast<Complex>());
    TreeState<Complex> state(tree);
    UpdatePositions(tree, Q.data(), &state);
    UpdateInertias(tree, &state);
    Eigen::MatrixXcd M(n, n);
    MassMatrix(tree, &state, M.data());
    return M.imag() / kComplexStep;
  }
  /// The complex step along tangent η_j, or along v_j.
  Vector Column(int j, bool along_v) {
    ComplexVector Q = q.cast<Complex>(), V = v.cast<Complex>();
    if (along_v) {
      V(j) += Complex(0, kComplexStep);
    } else {
      ComplexVector unit = ComplexVector::Zero(n);
      unit(j) = Complex(0, kComplexStep);
      Q += PositionRate<Complex>(tree, Q, unit);
    }
    return Outcome<Complex>(tree, Q, V, vdot, forces).imag() / kComplexStep;
  }

  RandomTrees random;
  RigidBodyTree tree;
  int n;
  Vector q, v, vdot;
  std::vector<PointForce> forces;
};

/// Column k of M is the effort of a unit acceleration: the two algorithms share
/// nothing but inertias.
TEST_P(RigidBodyLaws, MassMatrixIsInverseDynamicsOfUnitAccelerations) {
  const Matrix M = Mass(q);
  const Vector bias = Outcome<double>(tree, q, v, Vector::Zero(n), {});
  for (int k = 0; k < n; ++k) {
    const Vector column = Outcome<double>(tree, q, v, Vector::Unit(n, k), {}) - bias;
    EXPECT_LE((column - M.col(k)).cwiseAbs().maxCoeff(), kRounding * M.cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(0, (M - M.transpose()).cwiseAbs().maxCoeff());
  EXPECT_EQ(Eigen::Success, M.llt().info());
}

TEST_P(RigidBodyLaws, TreeFactorSolves) {
  const Matrix M = Mass(q);
  Matrix factor = M;
  const TreeFactor solver(tree);
  ASSERT_EQ(-1, solver.Compute(&factor));
  Matrix x = Matrix::Random(n, 3);
  const Matrix right = x;
  solver.Solve(factor, x);
  // Backward stable: the residual is rounding, of |M| |x|.
  EXPECT_LE((M * x - right).cwiseAbs().maxCoeff(),
            kRounding * M.cwiseAbs().maxCoeff() * std::max(1.0, x.cwiseAbs().maxCoeff()));
}

/// vᵀ (Ṁ − 2C) v = 0: what Coriolis forces do is the change of M, d/dt ½ vᵀMv = vᵀ(τ + gravity).
TEST_P(RigidBodyLaws, CoriolisForcesDoNoWork) {
  RigidBodyTree weightless = tree;
  weightless.set_gravity(Vec3<double>::Zero());
  const Vector bias = Outcome<double>(weightless, q, v, Vector::Zero(n), {});
  const Matrix rate = MassRate();
  const double scale = v.squaredNorm() * (rate.cwiseAbs().maxCoeff() + bias.cwiseAbs().maxCoeff());
  EXPECT_NEAR(0.5 * v.dot(rate * v), v.dot(bias), kRounding * scale);
}

/// Ṁ − 2C is skew for the C of the Christoffel symbols, which is ½ ∂b/∂v where b is quadratic in v.
/// (With ball joints v is no rate of coordinates, and ∂b/∂v has the structure constants of
/// rotations too.)
TEST_P(RigidBodyLaws, MassRateMinusTwiceCoriolisIsSkew) {
  tree = random.Tree(2 + GetParam() % 9, false, false);
  n = tree.dof();
  q = random.Positions(tree);
  v = random.NormalVector(n);
  vdot = random.NormalVector(n);
  forces.clear();
  Matrix tau_v(n, n);
  for (int j = 0; j < n; ++j) tau_v.col(j) = Column(j, true);
  const Matrix rate = MassRate(), skew = rate - tau_v;
  EXPECT_LE((skew + skew.transpose()).cwiseAbs().maxCoeff(),
            kRounding * (1 + rate.cwiseAbs().maxCoeff()));
}

TEST_P(RigidBodyLaws, DerivativesOfInverseDynamicsAndOfPoints) {
  TreeState<double> state(tree);
  Update(tree, q.data(), v.data(), &state);
  std::vector<PointForces<double>> external(tree.num_bodies());
  for (PointForces<double>& sum : external) sum.SetZero();
  for (const PointForce& f : forces) {
    external[f.body].Add(PointPosition(state, f.body, f.local) - state.body[f.body].reference,
                         f.force);
  }
  Matrix M(n, n), tau_q(n, n), tau_v(n, n);
  Vector tau(n);
  MassMatrix(tree, &state, M.data());
  InverseDynamics(tree, tree.gravity(), vdot.data(), external.data(), &state, tau.data());
  InverseDynamicsJacobian<double> jacobian(tree);
  jacobian.Compute(tree, tree.gravity(), external.data(), state, tau_q.data(), tau_v.data());
  const double scale = 1 + tau_q.cwiseAbs().maxCoeff() + tau_v.cwiseAbs().maxCoeff();
  for (int j = 0; j < n; ++j) {
    const Vector by_q = Column(j, false), by_v = Column(j, true);
    EXPECT_LE((by_q.head(n) - tau_q.col(j)).cwiseAbs().maxCoeff(), kRounding * scale) << j;
    EXPECT_LE((by_v.head(n) - tau_v.col(j)).cwiseAbs().maxCoeff(), kRounding * scale) << j;
    for (std::size_t k = 0; k < forces.size(); ++k) {
      const int body = forces[k].body;
      bool moves = false;
      for (int i = tree.last_dof(body); i >= 0; i = tree.dof_parent(i)) moves |= i == j;
      const Vector point_q = by_q.segment(n + 9 * k, 9), point_v = by_v.segment(n + 9 * k, 9);
      if (!moves) {
        EXPECT_EQ(0, point_q.norm() + point_v.norm());
        continue;
      }
      const PointMotion<double> motion = MovePoint(state, tree.gravity(), body, forces[k].local);
      const BodyColumns<double> of_body = DifferentiateBody(tree, tree.gravity(), state, body, j);
      const PointColumns<double> c = DifferentiatePoint(state, body, of_body, motion, j);
      Vector expected_q(9), expected_v(9);
      expected_q << c.jacobian, c.velocity_q, c.acceleration_q;
      expected_v << Vec3<double>::Zero(), c.jacobian, c.acceleration_v;
      EXPECT_LE((expected_q - point_q).norm(), kRounding * (1 + point_q.norm()));
      EXPECT_LE((expected_v - point_v).norm(), kRounding * (1 + point_v.norm()));
      EXPECT_LE((PointColumn(state, body, j, motion.position) - c.jacobian).norm(), kRounding);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(RandomTrees, RigidBodyLaws, testing::Range(0, 60));

/// Far from the world's origin a robot moves as at the origin: to the rounding of its
/// position, 1e-13.
TEST(RigidBodyTree, LosesNoDigitsFarFromTheOrigin) {
  RandomTrees random(5);
  const RigidBodyTree tree = random.Tree(8, true);
  const int n = tree.dof();
  Vector q = random.Positions(tree);
  const Vector v = random.NormalVector(n), a = random.NormalVector(n);
  const Vector near = Outcome<double>(tree, q, v, a, {});
  q.head(3) += Vec3<double>(1000, -2000, 500);
  EXPECT_LE((Outcome<double>(tree, q, v, a, {}) - near).cwiseAbs().maxCoeff(),
            1e-11 * (1 + near.cwiseAbs().maxCoeff()));
}

/// Behind a mechanism that is 1e6 m away a robot moves as alone: each branch from the world has a
/// reference point of its own.
TEST(RigidBodyTree, LosesNoDigitsBehindAnotherFarAway) {
  RandomTrees random(6);
  const RigidBodyTree alone = random.Tree(8, true);
  const int n = alone.dof();
  RigidBodyTree both;
  both.set_gravity(alone.gravity());
  both.AddBody(-1, JointKind::kPrismatic, Pose(), random.RandomInertia());
  for (const RigidBodyTree::Body& body : alone.bodies()) {
    both.AddBody(body.parent < 0 ? -1 : body.parent + 1, body.joint, body.placement, body.inertia);
  }
  const Vector q = random.Positions(alone), v = random.NormalVector(n), a = random.NormalVector(n);
  Vector q_both(q.size() + 1), v_both(n + 1), a_both(n + 1);
  q_both << 1e6, q;
  v_both << 0.5, v;
  a_both << 0.2, a;
  PointForce force{7, random.NormalVector(3), random.NormalVector(3)};
  const Vector expected = Outcome<double>(alone, q, v, a, {force});
  ++force.body;
  const Vector behind = Outcome<double>(both, q_both, v_both, a_both, {force});
  EXPECT_LE((behind.tail(expected.size()) - expected).cwiseAbs().maxCoeff(),
            1e-14 * (1 + expected.cwiseAbs().maxCoeff()));
}

TEST(RigidBodyTree, RefusesParentsThatDoNotExistAndTooManyFreedoms) {
  RigidBodyTree tree;
  EXPECT_THROW(tree.AddBody(0, JointKind::kRevolute, Pose()), std::invalid_argument);
  for (int k = 0; k < RigidBodyTree::kMaxDof; ++k) {
    tree.AddBody(k - 1, JointKind::kPrismatic, Pose());
  }
  EXPECT_THROW(tree.AddBody(0, JointKind::kPrismatic, Pose()), std::invalid_argument);
}

TEST(RigidBodyTree, FactorTellsThatAMassIsMissing) {
  RigidBodyTree tree;
  BodyInertia point;
  point.mass = 1;  // on the axis that it turns about
  tree.AddBody(-1, JointKind::kRevolute, Pose(), point);
  TreeState<double> state(tree);
  const double q = 0.3;
  UpdatePositions(tree, &q, &state);
  UpdateInertias(tree, &state);
  Matrix M(1, 1);
  MassMatrix(tree, &state, M.data());
  EXPECT_EQ(0, TreeFactor(tree).Compute(&M));
}

}  // namespace
}  // namespace contact_flow
