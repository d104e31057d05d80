// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/contact_dynamics.h"

#include <cmath>
#include <limits>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/fixed_size.h"

namespace contact_flow {
namespace {

/// out = sign · A B [rows×columns] for small matrices, where B has many zeros; `out` must not
/// alias.
void MultiplySmall(double sign, const Matrix& A, const Matrix& B, double* out, int stride) {
  WithFixedSize(static_cast<int>(A.rows()), [&](auto rows) {
    const double* b = B.data();
    double* __restrict target = out;
    for (int c = 0; c < B.cols(); ++c, target += stride) {
      const double* __restrict a = A.data();
      for (int r = 0; r < rows; ++r) target[r] = 0;
      for (int k = 0; k < A.cols(); ++k, ++b, a += rows) {
        if (*b == 0) continue;
        const double factor = sign * *b;
        for (int r = 0; r < rows; ++r) target[r] += factor * a[r];
      }
    }
  });
}

}  // namespace

ContactDynamics::ContactDynamics(const MechanicalSystem& system, const VectorRef& u,
                                 const Variables& variables)
    : system_(system),
      u_(u),
      variables_(variables),
      d_(system.dof()),
      nq_(system.num_positions()),
      n_(system.num_rows()),
      k_(variables.Size(system)),
      constant_(system.HasConstantMass() && system.HasAffineConstraints()),
      mass_(d_, d_),
      mass_factor_(d_),
      applied_(d_),
      acceleration_(d_),
      force_(n_),
      acceleration_jacobian_(d_, 2 * d_ + k_),
      force_jacobian_(n_, 2 * d_ + k_),
      variable_momentum_(d_, k_) {
  residual_.momentum_q.resize(d_, d_);
  residual_.momentum_v.resize(d_, d_);
  residual_.momentum_u.resize(d_, system.num_inputs());
  residual_.constraint_q.resize(n_, d_);
  residual_.constraint_v.resize(n_, d_);
}

void ContactDynamics::SetMode(ContactMode mode) {
  mode_ = mode;
  active_.clear();
  for (int i : mode - system_.compliant()) active_.push_back(i);
  for (int i = 0; i < system_.num_bilateral(); ++i) {
    active_.push_back(system_.num_constraints() + i);
  }
  sliding_.clear();
  turning_ = false;
  if (system_.HasFriction()) {
    int column = 0;
    for (int i : mode - system_.compliant()) {
      const Friction& friction = system_.friction()[i];
      const Letter letter = mode.LetterOf(i);
      if (letter == Letter::kStick) {
        for (int k = 0; k < friction.dimension; ++k) active_.push_back(friction.row + k);
      } else if (friction.dimension > 0 && friction.coefficient > 0) {
        Sliding sliding{i, column, friction.coefficient, friction};
        sliding.direction(0) = letter == Letter::kBackward ? -1 : 1;
        turning_ = turning_ || friction.dimension == 2;
        sliding_.push_back(sliding);
      }
      ++column;
    }
  }
  const int k = static_cast<int>(active_.size());
  active_jacobian_.resize(k, d_);
  reach_.resize(d_, k);
  momentum_map_.resize(k, d_);
  force_map_.resize(k, d_);
  delassus_inverse_.resize(k, k);
  bias_.setZero(k);
  multiplier_.setZero(k);
  active_residual_.setZero(k, 2 * d_ + k_);
  active_force_jacobian_.resize(k, 2 * d_ + k_);
}

void ContactDynamics::Factorize(const VectorRef& x) {
  mass_factor_.compute(mass_);
  regular_ = mass_factor_.info() == Eigen::Success;
  const int k = static_cast<int>(active_.size());
  if (k == 0) return;
  system_.Constraints(x.head(nq_), x.tail(d_), &terms_);
  for (int i = 0; i < k; ++i) {
    active_jacobian_.row(i) = terms_.jacobian.row(active_[i]);
    bias_(i) = terms_.bias(active_[i]);
    reach_.col(i) = active_jacobian_.row(i);
    mass_factor_.matrixL().solveInPlace(reach_.col(i));
  }
  if (!sliding_.empty()) return FactorizeSliding(x);
  delassus_inverse_.noalias() = reach_.transpose().lazyProduct(reach_);
  delassus_factor_.compute(delassus_inverse_);
  regular_ = regular_ && delassus_factor_.info() == Eigen::Success;
}

void ContactDynamics::Invert() {
  inverse_.setIdentity(d_, d_);
  mass_factor_.solveInPlace(inverse_);
  if (!active_.empty()) {
    delassus_inverse_.setIdentity();
    momentum_map_.noalias() = active_jacobian_.lazyProduct(inverse_);
    if (sliding_.empty()) {
      delassus_factor_.solveInPlace(delassus_inverse_);
      force_map_.noalias() = delassus_inverse_.lazyProduct(momentum_map_);
      inverse_.noalias() -= momentum_map_.transpose().lazyProduct(force_map_);
    } else {
      delassus_inverse_ = sliding_factor_.solve(delassus_inverse_).eval();
      force_map_.noalias() = delassus_inverse_.lazyProduct(momentum_map_);
      response_ = push_;
      mass_factor_.matrixU().solveInPlace(response_);  // M⁻¹ W
      inverse_.noalias() -= response_.lazyProduct(force_map_);
      response_ = (response_ * delassus_inverse_).eval();
    }
  }
  if (regular_) return;
  inverse_.setConstant(std::numeric_limits<double>::quiet_NaN());
  force_map_.setConstant(std::numeric_limits<double>::quiet_NaN());
}

void ContactDynamics::Evaluate(const VectorRef& x, ContactMode mode) {
  ++evaluations_;
  const bool same_mode = factorized_ && mode == mode_ && !turning_;
  system_.Dynamics(x.head(nq_), x.tail(d_), u_, mode, constant_ && factorized_ ? nullptr : &mass_,
                   &applied_);
  if (!same_mode) SetMode(mode);
  if (!(constant_ && same_mode)) Factorize(x);
  if (constant_ && !same_mode) Invert();
  factorized_ = true;
  if (constant_) {
    Multiply();
  } else {
    Solve();
  }
  force_.setZero();
  for (std::size_t i = 0; i < active_.size(); ++i) force_(active_[i]) = multiplier_(i);
  if (!sliding_.empty()) AddSlidingForce();
}

/// The bias of constant constraints is zero.
void ContactDynamics::Multiply() {
  WithFixedSize(d_, [&](auto d) {
    const double* __restrict column = inverse_.data();
    double* __restrict a = acceleration_.data();
    for (int r = 0; r < d; ++r) a[r] = 0;
    for (int k = 0; k < d; ++k, column += d) {
      const double factor = applied_(k);
      for (int r = 0; r < d; ++r) a[r] += factor * column[r];
    }
  });
  for (Eigen::Index i = 0; i < multiplier_.size(); ++i) {
    multiplier_(i) = -force_map_.row(i).dot(applied_);
  }
}

void ContactDynamics::Solve() {
  acceleration_ = applied_;
  mass_factor_.matrixL().solveInPlace(acceleration_);  // y
  if (!active_.empty()) {
    multiplier_ = -bias_;
    multiplier_.noalias() -= reach_.transpose().lazyProduct(acceleration_);
    if (sliding_.empty()) {
      delassus_factor_.solveInPlace(multiplier_);
      acceleration_.noalias() += reach_.lazyProduct(multiplier_);
    } else {
      multiplier_ = sliding_factor_.solve(multiplier_).eval();
      acceleration_.noalias() += push_.lazyProduct(multiplier_);
    }
  }
  mass_factor_.matrixU().solveInPlace(acceleration_);
  if (regular_) return;
  acceleration_.setConstant(std::numeric_limits<double>::quiet_NaN());
  multiplier_.setConstant(std::numeric_limits<double>::quiet_NaN());
}

Vector ContactDynamics::Field(const VectorRef& x, ContactMode mode) {
  Evaluate(x, mode);
  Vector field(2 * d_ + k_);
  field << x.tail(d_), acceleration_, Vector::Zero(k_);
  return field;
}

void ContactDynamics::Differentiate(const VectorRef& x, ContactMode mode) {
  Evaluate(x, mode);
  if (!constant_) Invert();
  const auto q = x.head(nq_), v = x.tail(d_);
  system_.DifferentiateDynamics(q, v, u_, mode, acceleration_, force_, &residual_);
  if (k_ > 0) DifferentiateByVariables(x);
  if (!sliding_.empty()) DifferentiateDirections(x);
  MultiplySmall(-1, inverse_, residual_.momentum_q, &acceleration_jacobian_(0, 0), d_);
  MultiplySmall(-1, inverse_, residual_.momentum_v, &acceleration_jacobian_(0, d_), d_);
  if (k_ > 0)
    MultiplySmall(-1, inverse_, variable_momentum_, &acceleration_jacobian_(0, 2 * d_), d_);
  force_jacobian_.setZero();
  const int k = static_cast<int>(active_.size());
  if (k == 0) return;
  MultiplySmall(1, force_map_, residual_.momentum_q, &active_force_jacobian_(0, 0), k);
  MultiplySmall(1, force_map_, residual_.momentum_v, &active_force_jacobian_(0, d_), k);
  if (k_ > 0)
    MultiplySmall(1, force_map_, variable_momentum_, &active_force_jacobian_(0, 2 * d_), k);
  if (!constant_ || !variables_.parameters.empty()) {
    for (int i = 0; i < k; ++i) {
      active_residual_.row(i).head(d_) = residual_.constraint_q.row(active_[i]);
      active_residual_.row(i).segment(d_, d_) = residual_.constraint_v.row(active_[i]);
    }
    active_force_jacobian_.noalias() -= delassus_inverse_.lazyProduct(active_residual_);
    if (sliding_.empty()) {
      acceleration_jacobian_.noalias() -= force_map_.transpose().lazyProduct(active_residual_);
    } else {
      acceleration_jacobian_.noalias() -= response_.lazyProduct(active_residual_);
    }
  }
  for (int i = 0; i < k; ++i) force_jacobian_.row(active_[i]) = active_force_jacobian_.row(i);
  if (!sliding_.empty()) DifferentiateSlidingForce();
}

/// ∂r₁ and ∂r₂ by the variables, at the point last evaluated.
void ContactDynamics::DifferentiateByVariables(const VectorRef& x) {
  const int inputs = variables_.inputs ? system_.num_inputs() : 0;
  variable_momentum_.leftCols(inputs) = residual_.momentum_u.leftCols(inputs);
  if (variables_.parameters.empty()) return;
  system_.DifferentiateDynamicsByParameters(x.head(nq_), x.tail(d_), u_, mode_, acceleration_,
                                            force_, variables_.parameters, &parameter_residual_);
  variable_momentum_.rightCols(k_ - inputs) = parameter_residual_.momentum;
  for (std::size_t i = 0; i < active_.size(); ++i) {
    active_residual_.row(i).tail(k_ - inputs) = parameter_residual_.constraint.row(active_[i]);
  }
}

Vector ContactDynamics::ForceRate(const VectorRef& x, ContactMode mode) {
  Differentiate(x, mode);
  return force_jacobian_.leftCols(d_) * x.tail(d_) +
         force_jacobian_.middleCols(d_, d_) * acceleration_;
}

double ContactDynamics::ForceRate(const VectorRef& x, ContactMode mode, int i) {
  Differentiate(x, mode);
  return force_jacobian_.row(i).head(d_).dot(x.tail(d_)) +
         force_jacobian_.row(i).segment(d_, d_).dot(acceleration_);
}

void Delassus(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u, ContactMode C,
              Matrix* G, Vector* b) {
  const int d = system.dof(), k = C.Size();
  G->resize(k, k);
  b->resize(k);
  if (k == 0) return;
  const InverseInertia inertia(system, x.head(system.num_positions()), x.tail(d), u, ContactMode());
  const Matrix A = inertia.Rows(C);
  *G = A * (inertia * A.transpose());
  *b = A * inertia.FreeAcceleration();
  int row = 0;
  for (int i : C) (*b)(row++) += inertia.terms().bias(i);
}

}  // namespace contact_flow
