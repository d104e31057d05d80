// SPDX-License-Identifier: BSD-3-Clause
// Every robot against DART, where it is installed (libdart-dev). Our joints are theirs one by one;
// the numbers of a ball are a rotation vector there, and its velocities the angular velocity in
// body axes.
#include "test/model/rigid_body/oracle.h"

#if CONTACT_FLOW_HAVE_DART
#include <dart/dynamics/dynamics.hpp>
#endif

namespace contact_flow {
namespace {

#if CONTACT_FLOW_HAVE_DART

namespace dd = dart::dynamics;

class DartOracle : public Oracle {
 public:
  explicit DartOracle(const RigidBodyTree& tree) : tree_(tree), skeleton_(dd::Skeleton::create()) {
    testing::internal::CaptureStderr();  // it warns of bodies without mass
    skeleton_->setGravity(tree.gravity());
    for (const RigidBodyTree::Body& body : tree.bodies()) {
      dd::BodyNode* const parent = body.parent < 0 ? nullptr : nodes_[body.parent];
      Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
      place.linear() = body.placement.rotation;
      place.translation() = body.placement.position;
      const BodyInertia& inertia = body.inertia;
      dd::BodyNode::Properties node;
      node.mName = "b" + std::to_string(nodes_.size());
      node.mInertia = dd::Inertia(inertia.mass, inertia.com, inertia.central);
      const auto add = [&](auto properties, auto* kind) {
        using Joint = std::remove_pointer_t<decltype(kind)>;
        properties.mName = "j" + std::to_string(nodes_.size());
        properties.mT_ParentBodyToJoint = place;
        nodes_.push_back(
            skeleton_->createJointAndBodyNodePair<Joint>(parent, properties, node).second);
      };
      switch (body.joint) {
        case JointKind::kRevolute: {
          dd::RevoluteJoint::Properties properties;
          properties.mAxis = Eigen::Vector3d::UnitZ();
          add(properties, static_cast<dd::RevoluteJoint*>(nullptr));
          break;
        }
        case JointKind::kPrismatic: {
          dd::PrismaticJoint::Properties properties;
          properties.mAxis = Eigen::Vector3d::UnitZ();
          add(properties, static_cast<dd::PrismaticJoint*>(nullptr));
          break;
        }
        case JointKind::kTranslation:
          add(dd::TranslationalJoint::Properties(), static_cast<dd::TranslationalJoint*>(nullptr));
          break;
        case JointKind::kBall:
          add(dd::BallJoint::Properties(), static_cast<dd::BallJoint*>(nullptr));
          break;
      }
    }
    testing::internal::GetCapturedStderr();
  }

  OracleAnswer At(const Vector& q, const Vector& v, int body, const Vec3<double>& point) override {
    const int n = tree_.dof();
    for (int i = 0; i < tree_.num_bodies(); ++i) {
      const RigidBodyTree::Body& fixed = tree_.bodies()[i];
      dd::Joint* const joint = nodes_[i]->getParentJoint();
      if (fixed.joint == JointKind::kBall) {
        joint->setPositions(
            dd::BallJoint::convertToPositions(Eigen::Matrix3d(QuaternionRotation(&q(fixed.q)))));
      } else {
        joint->setPositions(q.segment(fixed.q, fixed.num_dofs));
      }
      joint->setVelocities(v.segment(fixed.v, fixed.num_dofs));
    }
    skeleton_->clearInternalForces();
    skeleton_->computeForwardDynamics();
    const Matrix& mass = skeleton_->getMassMatrix();
    const Vector bias = skeleton_->getCoriolisAndGravityForces(),
                 acceleration = skeleton_->getAccelerations();
    OracleAnswer answer{Matrix(n, n), Vector(n), Vector(n), Matrix::Zero(3, n)};
    const std::vector<int> theirs = Indices();
    for (int j = 0; j < n; ++j) {
      answer.bias(j) = bias(theirs[j]);
      answer.acceleration(j) = acceleration(theirs[j]);
      for (int k = 0; k < n; ++k) answer.mass(j, k) = mass(theirs[j], theirs[k]);
    }
    const Matrix jacobian = skeleton_->getLinearJacobian(nodes_[body], point);
    for (int j = 0; j < n; ++j) answer.jacobian.col(j) = jacobian.col(theirs[j]);
    return answer;
  }

 private:
  /// Their index of each of our velocity numbers.
  std::vector<int> Indices() const {
    std::vector<int> indices(tree_.dof());
    for (int i = 0; i < tree_.num_bodies(); ++i) {
      for (int k = 0; k < tree_.bodies()[i].num_dofs; ++k) {
        indices[tree_.bodies()[i].v + k] =
            static_cast<int>(nodes_[i]->getParentJoint()->getIndexInSkeleton(k));
      }
    }
    return indices;
  }

  const RigidBodyTree& tree_;
  dd::SkeletonPtr skeleton_;
  std::vector<dd::BodyNode*> nodes_;
};

TEST(DartOracle, AgreesOnEveryRobot) {
  CompareWithOracle([](const RigidBodyTree& tree) { return std::make_unique<DartOracle>(tree); });
}

#else

TEST(DartOracle, AgreesOnEveryRobot) { GTEST_SKIP() << "built without DART (libdart-dev)"; }

#endif

}  // namespace
}  // namespace contact_flow
