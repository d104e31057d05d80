// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "contact_flow/model/configuration_space.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// (σ I − DF)⁻¹ for q̇ = N(q) v, v̇ = a(q, v), real or complex σ, by a factor of order d: with
/// tangents η, δq = N η,
///   σ η + ad_v η − w = ρ,   σ w − K η − D w = r      ⇒  η = E (w + ρ),  E = (σ I + ad_v)⁻¹,
///   (σ I − D − K E) w = r + K E ρ.
/// What changes the norm of a quaternion is divided by σ.
template <class S>
class StageSolver {
 public:
  using Column = Eigen::Matrix<S, Eigen::Dynamic, 1>;

  /// For [K D] [d×2d] where the velocities are v.
  void Factor(const ConfigurationSpace& space, const VectorRef& v, const Matrix& jacobian,
              S sigma) {
    const int d = space.dof();
    sigma_ = sigma;
    const S inverse = S(1) / sigma;
    through_ = jacobian.leftCols(d) * inverse;  // K E
    turns_.clear();
    for (const ConfigurationSpace::Rotation& rotation : space.rotations()) {
      const Eigen::Vector3d w = v.segment<3>(rotation.v);
      Eigen::Matrix3d W;
      W << 0, -w(2), w(1), w(2), 0, -w(0), -w(1), w(0), 0;
      const S b = S(1) / (sigma * sigma + w.squaredNorm());
      const Eigen::Matrix<S, 3, 3> turn =
          inverse * (Eigen::Matrix<S, 3, 3>::Identity() - (sigma * b) * W + b * (W * W));
      turns_.push_back(turn);
      through_.middleCols(rotation.v, 3) =
          jacobian.middleCols(rotation.v, 3).template cast<S>() * turn;
    }
    matrix_ = -jacobian.rightCols(d) - through_;
    matrix_.diagonal().array() += sigma;
    factor_.compute(matrix_);
  }

  /// Replaces (r_q, r_v) [nq+d] by the solution, at the configuration q.
  void Solve(const ConfigurationSpace& space, const double* q, Column* r) {
    const int d = space.dof(), nq = space.num_positions();
    const std::vector<int>& velocity_of = space.line_velocities();
    rho_.resize(d);
    norm_.resize(static_cast<Eigen::Index>(space.rotations().size()));
    for (int k = 0; k < nq; ++k) {
      if (velocity_of[k] >= 0) rho_(velocity_of[k]) = (*r)(k);
    }
    Eigen::Index turn = 0;
    for (const ConfigurationSpace::Rotation& rotation : space.rotations()) {
      const double* a = q + rotation.q;
      const S* e = r->data() + rotation.q;
      const double size = 1 / (a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + a[3] * a[3]);
      S* out = rho_.data() + rotation.v;  // 2 vec(ā ⊗ e) / |a|²
      out[0] = 2 * size * (a[0] * e[1] - a[1] * e[0] - a[2] * e[3] + a[3] * e[2]);
      out[1] = 2 * size * (a[0] * e[2] - a[2] * e[0] - a[3] * e[1] + a[1] * e[3]);
      out[2] = 2 * size * (a[0] * e[3] - a[3] * e[0] - a[1] * e[2] + a[2] * e[1]);
      norm_(turn++) = size * (a[0] * e[0] + a[1] * e[1] + a[2] * e[2] + a[3] * e[3]) / sigma_;
    }
    w_ = r->tail(d);
    w_.noalias() += through_.lazyProduct(rho_);
    solution_.noalias() = factor_.solve(w_);
    r->tail(d) = solution_;
    rho_ += solution_;
    turn = 0;
    for (int k = 0; k < nq; ++k) {
      if (velocity_of[k] >= 0) (*r)(k) = rho_(velocity_of[k]) / sigma_;
    }
    for (const ConfigurationSpace::Rotation& rotation : space.rotations()) {
      const double* a = q + rotation.q;
      const Eigen::Matrix<S, 3, 1> w = turns_[turn] * rho_.template segment<3>(rotation.v);
      S* out = r->data() + rotation.q;  // ½ a ⊗ (0, η)
      out[0] = -0.5 * (a[1] * w[0] + a[2] * w[1] + a[3] * w[2]) + norm_(turn) * a[0];
      out[1] = 0.5 * (a[0] * w[0] + a[2] * w[2] - a[3] * w[1]) + norm_(turn) * a[1];
      out[2] = 0.5 * (a[0] * w[1] + a[3] * w[0] - a[1] * w[2]) + norm_(turn) * a[2];
      out[3] = 0.5 * (a[0] * w[2] + a[1] * w[1] - a[2] * w[0]) + norm_(turn) * a[3];
      ++turn;
    }
  }

 private:
  using Square = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;

  S sigma_;
  Square through_, matrix_;
  std::vector<Eigen::Matrix<S, 3, 3>> turns_;
  Eigen::PartialPivLU<Square> factor_;
  Column rho_, w_, solution_, norm_;
};

}  // namespace contact_flow
