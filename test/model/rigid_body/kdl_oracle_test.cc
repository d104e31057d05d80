// SPDX-License-Identifier: BSD-3-Clause
// Every robot against KDL, where it is installed (liborocos-kdl-dev). KDL has no ball joints: a
// ball is three turns about z, y, x there, and velocities are related by ω = E(θ) θ̇.
#include "test/model/rigid_body/oracle.h"

#if CONTACT_FLOW_HAVE_KDL
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <kdl/tree.hpp>
#include <kdl/treeidsolver_recursive_newton_euler.hpp>
#include <kdl/treejnttojacsolver.hpp>

#include "contact_flow/autodiff.h"
#endif

namespace contact_flow {
namespace {

#if CONTACT_FLOW_HAVE_KDL

KDL::Vector ToKdl(const Vec3<double>& v) { return {v(0), v(1), v(2)}; }
KDL::Frame ToKdl(const Pose& pose) {
  const Mat3<double>& R = pose.rotation;
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1),
                        R(2, 2)),
          ToKdl(pose.position)};
}
KDL::RigidBodyInertia ToKdl(const BodyInertia& inertia) {
  const Mat3<double>& I = inertia.central;
  const KDL::RotationalInertia central(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
  return KDL::RigidBodyInertia(inertia.mass, ToKdl(inertia.com)) +
         KDL::RigidBodyInertia(0, KDL::Vector::Zero(), central);
}

/// E(θ) for R = Rz(θ₀) Ry(θ₁) Rx(θ₂): angular velocity in body axes.
template <class S>
Mat3<S> EulerRates(const S* angle) {
  using std::cos;
  using std::sin;
  const S cb = cos(angle[1]), sb = sin(angle[1]), cc = cos(angle[2]), sc = sin(angle[2]);
  Mat3<S> E = ZeroMat3<S>();
  E(0, 0) = -sb;
  E(1, 0) = cb * sc;
  E(2, 0) = cb * cc;
  E(1, 1) = cc;
  E(2, 1) = -sc;
  E(0, 2) = S(1.0);
  return E;
}

class KdlOracle : public Oracle {
 public:
  explicit KdlOracle(const RigidBodyTree& tree) : tree_(tree), kdl_("world") {
    for (int i = 0; i < tree.num_bodies(); ++i) {
      const RigidBodyTree::Body& body = tree.bodies()[i];
      std::string parent = body.parent < 0 ? "world" : Name(tree.bodies()[body.parent].last_dof);
      for (int k = 0; k < body.num_dofs; ++k) {
        const int j = body.v + k;
        const Pose frame = k == 0 ? body.placement : Pose();
        const bool slides =
            body.joint == JointKind::kPrismatic || body.joint == JointKind::kTranslation;
        // Balls turn about z, y, x, slides go along x, y, z, single joints along z.
        const int axis = body.num_dofs == 1 ? 2 : slides ? k : 2 - k;
        const KDL::Joint joint(Name(j), ToKdl(frame.position),
                               ToKdl(Vec3<double>(frame.rotation.col(axis))),
                               slides ? KDL::Joint::TransAxis : KDL::Joint::RotAxis);
        const KDL::RigidBodyInertia inertia =
            j == body.last_dof ? ToKdl(body.inertia) : KDL::RigidBodyInertia::Zero();
        kdl_.addSegment(KDL::Segment(Name(j), joint, ToKdl(frame), inertia), parent);
        parent = Name(j);
      }
    }
    solver_ = std::make_unique<KDL::TreeIdSolver_RNE>(kdl_, ToKdl(tree.gravity()));
  }

  OracleAnswer At(const Vector& q, const Vector& v, int body, const Vec3<double>& point) override {
    const int n = tree_.dof();
    Matrix T = Matrix::Identity(n, n);  // v = T θ̇
    Vector theta(n);
    for (const RigidBodyTree::Body& b : tree_.bodies()) {
      if (b.joint != JointKind::kBall) {
        theta.segment(b.v, b.num_dofs) = q.segment(b.q, b.num_dofs);
        continue;
      }
      const Mat3<double> R = QuaternionRotation(&q(b.q));
      theta(b.v) = std::atan2(R(1, 0), R(0, 0));
      theta(b.v + 1) = std::asin(-R(2, 0));
      theta(b.v + 2) = std::atan2(R(2, 1), R(2, 2));
      T.block<3, 3>(b.v, b.v) = EulerRates(&theta(b.v));
    }
    const Vector rate = T.partialPivLu().solve(v);
    Vector carried = Vector::Zero(n);  // Ṫ θ̇
    for (const RigidBodyTree::Body& b : tree_.bodies()) {
      if (b.joint != JointKind::kBall) continue;
      using S = Dual<double, 1>;
      S angle[3];
      for (int k = 0; k < 3; ++k) {
        angle[k] = S(theta(b.v + k));
        angle[k].d[0] = rate(b.v + k);
      }
      const Mat3<S> E = EulerRates(angle);
      for (int r = 0; r < 3; ++r) {
        for (int k = 0; k < 3; ++k) carried(b.v + r) += E(r, k).d[0] * rate(b.v + k);
      }
    }
    OracleAnswer answer{Matrix(n, n), Vector(n), Vector(n), Matrix::Zero(3, n)};
    const Matrix back = T.inverse();
    const Vector still = Efforts(theta, rate, Vector::Zero(n));
    for (int k = 0; k < n; ++k) {
      answer.mass.col(k) = Efforts(theta, rate, Vector::Unit(n, k)) - still;
    }
    // Mθ = Tᵀ M T, bθ = Tᵀ (b + M Ṫ θ̇).
    answer.mass = back.transpose() * answer.mass * back;
    answer.bias = back.transpose() * still - answer.mass * carried;
    answer.acceleration = answer.mass.ldlt().solve(-answer.bias);
    KDL::TreeJntToJacSolver jacobian_solver(kdl_);
    KDL::Jacobian jacobian(n);
    KDL::JntArray angles(n);
    for (int j = 0; j < n; ++j) angles(Index(j)) = theta(j);
    jacobian_solver.JntToJac(angles, jacobian, Name(tree_.last_dof(body)));
    // About the body's origin, in world axes: moved to the point.
    TreeState<double> state(tree_);
    UpdatePositions(tree_, q.data(), &state);
    const Vec3<double> arm = state.body[body].rotation * point;
    Matrix columns = Matrix::Zero(3, n);
    for (int j = 0; j < n; ++j) {
      const Eigen::Matrix<double, 6, 1> twist = jacobian.data.col(Index(j));
      columns.col(j) = twist.head<3>() + Cross<double>(twist.tail<3>(), arm);
    }
    answer.jacobian = columns * back;
    return answer;
  }

 private:
  static std::string Name(int j) { return "j" + std::to_string(j); }
  int Index(int j) const {
    return static_cast<int>(GetTreeElementQNr(kdl_.getSegment(Name(j))->second));
  }

  Vector Efforts(const Vector& theta, const Vector& rate, const Vector& acceleration) {
    const int n = tree_.dof();
    KDL::JntArray q(n), v(n), a(n), tau(n);
    for (int j = 0; j < n; ++j) {
      q(Index(j)) = theta(j);
      v(Index(j)) = rate(j);
      a(Index(j)) = acceleration(j);
    }
    solver_->CartToJnt(q, v, a, {}, tau);
    Vector efforts(n);
    for (int j = 0; j < n; ++j) efforts(j) = tau(Index(j));
    return efforts;
  }

  const RigidBodyTree& tree_;
  KDL::Tree kdl_;
  std::unique_ptr<KDL::TreeIdSolver_RNE> solver_;
};

TEST(KdlOracle, AgreesOnEveryRobot) {
  CompareWithOracle([](const RigidBodyTree& tree) { return std::make_unique<KdlOracle>(tree); });
}

#else

TEST(KdlOracle, AgreesOnEveryRobot) { GTEST_SKIP() << "built without KDL (liborocos-kdl-dev)"; }

#endif

}  // namespace
}  // namespace contact_flow
