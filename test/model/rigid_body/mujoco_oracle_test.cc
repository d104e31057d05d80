// SPDX-License-Identifier: BSD-3-Clause
// Every robot against MuJoCo, where it is installed (libmujoco-dev).
#include "test/model/rigid_body/oracle.h"

#if CONTACT_FLOW_HAVE_MUJOCO
#include "test/model/rigid_body/mujoco_model.h"
#endif

namespace contact_flow {
namespace {

#if CONTACT_FLOW_HAVE_MUJOCO

class MujocoOracle : public Oracle {
 public:
  explicit MujocoOracle(const RigidBodyTree& tree) : tree_(tree), mujoco_(tree) {}

  OracleAnswer At(const Vector& q, const Vector& v, int body, const Vec3<double>& point) override {
    const mjModel* m = mujoco_.model;
    mjData* d = mujoco_.data;
    const int n = tree_.dof();
    mujoco_.SetState(q, v);
    mj_forward(m, d);
    std::vector<double> full(n * n), jacobian(3 * n);
    mj_fullM(m, full.data(), d->qM);
    OracleAnswer answer{Matrix(n, n), Vector(n), Vector(n), Matrix::Zero(3, n)};
    const std::vector<int>& ours = mujoco_.ours();
    for (int i = 0; i < n; ++i) {
      answer.bias(ours[i]) = d->qfrc_bias[i];
      answer.acceleration(ours[i]) = d->qacc[i];
      for (int k = 0; k < n; ++k) answer.mass(ours[i], ours[k]) = full[i * n + k];
    }
    // A point of a body without mass is not one of theirs: where it is we say, and leave out the
    // joints behind it.
    TreeState<double> state(tree_);
    UpdatePositions(tree_, q.data(), &state);
    const Vec3<double> position = PointPosition(state, body, point);
    mj_jac(m, d, jacobian.data(), nullptr, position.data(), mujoco_.body(body));
    for (int k = 0; k < n; ++k) {
      if (ours[k] > tree_.last_dof(body)) continue;
      for (int r = 0; r < 3; ++r) answer.jacobian(r, ours[k]) = jacobian[r * n + k];
    }
    return answer;
  }

 private:
  const RigidBodyTree& tree_;
  MujocoModel mujoco_;
};

TEST(MujocoOracle, AgreesOnEveryRobot) {
  CompareWithOracle([](const RigidBodyTree& tree) { return std::make_unique<MujocoOracle>(tree); });
}

#else

TEST(MujocoOracle, AgreesOnEveryRobot) { GTEST_SKIP() << "built without MuJoCo (libmujoco-dev)"; }

#endif

}  // namespace
}  // namespace contact_flow
