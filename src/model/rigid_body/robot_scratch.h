// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstring>
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
        input(Vector::Zero(inputs)),
        positions_(tree.num_positions()),
        velocities_(tree.dof()) {}

  /// Poses and velocities of `state` at (q, v). One evaluation after another asks for the same:
  /// what is there already, to the bit, stays.
  void MoveTo(const RigidBodyTree& tree, const double* q, const double* v) {
    const bool placed = has_positions_ && Same(positions_, q);
    if (placed && Same(velocities_, v)) return;
    if (!placed) {
      std::copy_n(q, positions_.size(), positions_.begin());
      UpdatePositions(tree, q, &state);
      has_positions_ = true;
      has_inertias_ = false;
    }
    std::copy_n(v, velocities_.size(), velocities_.begin());
    UpdateVelocities(tree, v, &state);
  }
  /// The inertias there, after MoveTo.
  void TakeInertias(const RigidBodyTree& tree) {
    if (!has_inertias_) UpdateInertias(tree, &state);
    has_inertias_ = true;
  }

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
  Vector input;                                // after feedback [m]
  Vector error;                                // q ⊟ q_ref [nv]
  Matrix chain;                                // ∂r₁/∂u K_q
  std::unique_ptr<TreeState<double>> resting;  // at v = 0, where weight is borne
  Vector weight;                               // G [nv]
  Matrix weight_q;                             // ∂G/∂η
  double u[kMax];

 private:
  static bool Same(const std::vector<double>& known, const double* numbers) {
    return std::memcmp(known.data(), numbers, known.size() * sizeof(double)) == 0;
  }

  std::vector<double> positions_, velocities_;  // where `state` is
  bool has_positions_ = false;                  // it is anywhere yet
  bool has_inertias_ = false;                   // of these positions
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
