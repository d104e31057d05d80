// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "contact_flow/model/rigid_body/robot_system.h"

namespace contact_flow {

/// What the functions of a RobotSystem compute with: sized once, never allocating after.
struct RobotSystem::Scratch {
  static constexpr int kMax = ElementMotion::kMaxSize;

  Scratch(const RigidBodyTree& tree, int inputs)
      : state(tree),
        jacobian(tree),
        external(tree.num_bodies()),
        effort(tree.dof()),
        tau(tree.dof()),
        zero(Vector::Zero(tree.dof())),
        rows(tree),
        product(kMax, tree.dof()),
        by_u(kMax * (inputs + 1)),
        input(Vector::Zero(inputs)) {}

  void ClearForces() {
    for (PointForces<double>& forces : external) forces.SetZero();
    effort.setZero();
  }

  TreeState<double> state;
  InverseDynamicsJacobian<double> jacobian;
  std::vector<PointForces<double>> external;  // [bodies]
  Vector effort;                              // on joints, by elements [nv]
  Vector tau;                                 // [nv]
  const Vector zero;                          // [nv]
  ElementMotion motion;
  ElementRows rows;
  Matrix product;
  double number[kMax], e[kMax], by_z[kMax * kMax], by_rate[kMax * kMax];
  double slip_map[2 * kMax], slip_rate_z[2 * kMax], slip_rate_rate[2 * kMax], slip_z[2 * kMax];
  std::vector<double> by_u;
  Vector input;                                 // after feedback [m]
  Vector error;                                 // q ⊟ q_ref [nv]
  Matrix chain;                                 // ∂r₁/∂u K_q
  std::unique_ptr<TreeState<double>> resting;   // at v = 0, where weight is borne
  Vector weight;                                // G [nv]
  Matrix weight_q;                              // ∂G/∂η
  double u[kMax];
};

class RobotSystem::Loan {
 public:
  explicit Loan(const RobotSystem* system)
      : system_(system), scratch_(system->shelf_.scratch.exchange(nullptr)) {
    if (scratch_ == nullptr) {
      scratch_ = new Scratch(system->robot_.model.tree, system->num_inputs());
    }
  }
  ~Loan() { delete system_->shelf_.scratch.exchange(scratch_); }
  Loan(const Loan&) = delete;
  Loan& operator=(const Loan&) = delete;

  Scratch* get() const { return scratch_; }

 private:
  const RobotSystem* system_;
  Scratch* scratch_;
};

}  // namespace contact_flow
