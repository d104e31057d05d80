// SPDX-License-Identifier: BSD-3-Clause
// Forces of feet that stick against MuJoCo's, whose contacts are soft, in the limit of stiff ones.
#include <gtest/gtest.h>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"

#if CONTACT_FLOW_HAVE_MUJOCO
#include <cstdio>
#include <memory>
#include <random>

#include "test/model/rigid_body/mujoco_feet.h"
#endif

namespace contact_flow {
namespace {

#if CONTACT_FLOW_HAVE_MUJOCO

constexpr double kOverlap = 1e-9;  // MuJoCo sees contacts that overlap [m]

/// The quadruped with friction 0.7, which stands on its four feet and is pushed at its joints.
class Standing {
 public:
  Standing()
      : system_(LoadRobot(RobotFile("quadruped_friction"))), mujoco_(OnFeetInMujoco(*system_, 3)) {
    const NominalRun& nominal = system_->nominal();
    const Trajectory run = Simulate(*system_, nominal.x, nominal.u, 3, SimulateOptions());
    x_ = run.FinalState();
    x_.tail(system_->dof()).setZero();
    x_(2) -= kOverlap;  // base_z
  }

  Vector q() const { return x_.head(system_->num_positions()); }
  Vector v() const { return x_.tail(system_->dof()); }

  /// Aᵀ λ of ours [d] for setpoints u; empty where not all feet stick.
  Vector Ours(const Vector& u) {
    ContactDynamics dynamics(*system_, u);
    TouchingContacts touching;
    touching.still = ConstraintSet::All(4);
    const ContactMode mode = SelectWord(&dynamics, x_, touching, 1e-9);
    if (mode.Sticking() != ConstraintSet::All(4)) return {};
    dynamics.Evaluate(x_, mode);
    ConstraintTerms terms;
    system_->Constraints(q(), v(), &terms);
    return terms.jacobian.transpose() * dynamics.force();
  }

  /// The same of MuJoCo's contacts of impedance d, which give way by (1 − d)/d of what rigid ones
  /// would need.
  Vector Theirs(const Vector& u, double impedance) {
    mjModel* m = mujoco_->model;
    mjData* data = mujoco_->data;
    for (int g = 0; g < m->ngeom; ++g) {
      m->geom_solimp[mjNIMP * g] = m->geom_solimp[mjNIMP * g + 1] = impedance;
    }
    m->opt.iterations = 200;
    m->opt.tolerance = 0;
    Matrix mass;
    Vector effort;
    system_->Dynamics(q(), v(), u, ContactMode(ConstraintSet::All(4)), &mass, &effort);
    mujoco_->SetState(q(), v());
    mj_forward(m, data);
    EXPECT_EQ(4, data->ncon);
    const std::vector<int>& ours = mujoco_->ours();
    for (int k = 0; k < m->nv; ++k) {
      data->qfrc_applied[k] = effort(ours[k]) + data->qfrc_bias[k];
      data->qacc_warmstart[k] = 0;
    }
    mj_forward(m, data);
    Vector force(m->nv);
    for (int k = 0; k < m->nv; ++k) force(ours[k]) = data->qfrc_constraint[k];
    return force;
  }

  const RobotSystem& system() const { return *system_; }

 private:
  const std::unique_ptr<RobotSystem> system_;
  const std::unique_ptr<MujocoModel> mujoco_;
  Vector x_;
};

TEST(MujocoSticking, ForcesAgreeInTheLimitOfStiffContacts) {
  Standing standing;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int compared = 0;
  double worst = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Vector u = standing.system().nominal().u;
    for (double& setpoint : u) setpoint += 0.01 * normal(random);
    const Vector ours = standing.Ours(u);
    if (ours.size() == 0) continue;
    const Vector soft = standing.Theirs(u, 0.999), stiff = standing.Theirs(u, 0.9999);
    const double size = ours.cwiseAbs().maxCoeff();
    const double off_soft = (soft - ours).cwiseAbs().maxCoeff() / size;
    const double off_stiff = (stiff - ours).cwiseAbs().maxCoeff() / size;
    // What is left goes with what they give way by: ten times less of it.
    const double give = 0.001 / 0.999, less = 0.0001 / 0.9999;
    const Vector limit = (give * stiff - less * soft) / (give - less);
    EXPECT_LE(off_stiff, 1e-3);
    EXPECT_NEAR(10, off_soft / off_stiff, 0.5);
    worst = std::max(worst, (limit - ours).cwiseAbs().maxCoeff() / size);
    ++compared;
  }
  EXPECT_GT(compared, 20);
  EXPECT_LE(worst, 1e-5);
  std::printf("%d states, limits off by %.2g\n", compared, worst);
}

#else

TEST(MujocoSticking, ForcesAgreeInTheLimitOfStiffContacts) {
  GTEST_SKIP() << "built without MuJoCo (libmujoco-dev)";
}

#endif

}  // namespace
}  // namespace contact_flow
