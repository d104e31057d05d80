// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// The coefficients of the variational equation along an arc, in the coordinates (y, ẏ), y = δq, in
/// which it is of second order on every configuration space: ÿ = K y + D ẏ + S (δu, δp).
class ArcJacobian {
 public:
  ArcJacobian(ContactDynamics* dynamics, const Arc& arc)
      : dynamics_(*dynamics),
        space_(dynamics->system().space()),
        arc_(arc),
        d_(space_.dof()),
        k_(dynamics->num_variables()),
        x_(dynamics->system().state_size()),
        push_reach_(Vector::Zero(dynamics->system().num_constraints())) {}

  /// [K D] [d×2d] and S [d×k] at time t, column-major into `out` and `source`.
  void At(double t, double* out, double* source) {
    arc_.dense.Evaluate(t, x_.data());
    dynamics_.Differentiate(x_, arc_.mode);
    const Matrix& jacobian = dynamics_.acceleration_jacobian();
    Eigen::Map<Matrix> KD(out, d_, 2 * d_);
    KD = jacobian.leftCols(2 * d_);
    if (k_ > 0) Eigen::Map<Matrix>(source, d_, k_) = jacobian.rightCols(k_);
    if (!space_.IsFlat()) {  // δv = ẏ + ad_v y
      const Matrix bracket = space_.Bracket(x_.tail(d_));
      KD.leftCols(d_) += KD.rightCols(d_) * bracket - space_.Bracket(dynamics_.acceleration());
      KD.rightCols(d_) -= bracket;
    }
    for (int i : arc_.mode - dynamics_.system().compliant()) {
      const double force = dynamics_.force()(i);
      const double change = dynamics_.force_jacobian().row(i).head(2 * d_).lpNorm<1>();
      if (force > push_reach_(i) * change) push_reach_(i) = force / change;
    }
    ++count_;
  }

  /// F there as a tangent: (v, v̇) [2d], alike in (δq, δv) and in (y, ẏ), since ad_v v = 0.
  void Field(Vector* field) const {
    field->resize(2 * d_);
    *field << x_.tail(d_), dynamics_.acceleration();
  }

  /// A propagator of (y, ẏ) becomes one of (δq, δv).
  void ToVelocities(Matrix* phi) const {
    if (space_.IsFlat()) return;
    phi->middleRows(d_, d_) += space_.Bracket(arc_.x_end.tail(d_)) * phi->topRows(d_);
    phi->leftCols(d_) -= phi->middleCols(d_, d_) * space_.Bracket(arc_.x_begin.tail(d_));
  }

  long count() const { return count_; }
  const Vector& push_reach() const { return push_reach_; }  ///< see VariationStatistics [n]

 private:
  ContactDynamics& dynamics_;
  const ConfigurationSpace& space_;
  const Arc& arc_;
  const int d_;
  const int k_;
  Vector x_;
  Vector push_reach_;
  long count_ = 0;
};

/// The fastest rate [1/s] of ÿ = K y + D ẏ, jacobian = [K D]: the spectral radius of its companion
/// matrix, by power iteration. An estimate, to begin with.
inline double FastestRate(const Matrix& jacobian) {
  constexpr int kIterations = 16, kDiscarded = 4;
  const Eigen::Index d = jacobian.rows();
  Vector y(2 * d), next(2 * d);
  for (Eigen::Index i = 0; i < 2 * d; ++i) y(i) = 1 + 0.37 * static_cast<double>(i % 5);
  double growth = 0;
  for (int k = 0; k < kIterations; ++k) {
    next.head(d) = y.tail(d);
    next.tail(d).noalias() = jacobian.lazyProduct(y);
    const double factor = next.norm() / y.norm();
    if (!(factor > 0) || !std::isfinite(factor)) return 0;
    if (k >= kDiscarded) growth += std::log(factor);
    y = next / next.norm();
  }
  return std::exp(growth / (kIterations - kDiscarded));
}

/// Largest of `count` columns of a defect, relative to those of the propagator, or to 1 where these
/// are less.
inline double RelativeSize(const Matrix& defect, const Matrix& propagator, int first, int count) {
  if (count == 0) return 0;
  return defect.middleCols(first, count).cwiseAbs().maxCoeff() /
         std::max(1.0, propagator.middleCols(first, count).cwiseAbs().maxCoeff());
}

}  // namespace contact_flow
