// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/contact_dynamics.h"

#include <cmath>
#include <limits>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/fixed_size.h"

namespace contact_flow {
namespace {

/// out = sign · A B [rows×columns] for small matrices, where B has many zeros; `out` must not alias.
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

constexpr double kForceRounding = 1e-13;
/// A force or acceleration below this part of the largest one may vanish at the instant; others cannot.
constexpr double kNearZero = 1e-4;

}  // namespace

ContactDynamics::ContactDynamics(const MechanicalSystem& system, const VectorRef& u)
    : system_(system),
      u_(u),
      d_(system.dof()),
      n_(system.num_constraints()),
      constant_(system.HasConstantMass() && system.HasAffineConstraints()),
      mass_(d_, d_),
      mass_factor_(d_),
      applied_(d_),
      acceleration_(d_),
      force_(n_),
      acceleration_jacobian_(d_, 2 * d_),
      force_jacobian_(n_, 2 * d_) {
  residual_.momentum_q.resize(d_, d_);
  residual_.momentum_v.resize(d_, d_);
  residual_.momentum_u.resize(d_, system.num_inputs());
  residual_.constraint_q.resize(n_, d_);
  residual_.constraint_v.resize(n_, d_);
}

void ContactDynamics::Factorize(const VectorRef& x, ContactMode mode) {
  const auto q = x.head(d_), v = x.tail(d_);
  system_.Dynamics(q, v, u_, constant_ && factorized_ ? nullptr : &mass_, &applied_);
  const bool same_mode = factorized_ && mode == mode_;
  if (constant_ && same_mode) return;
  if (!same_mode) {
    active_.clear();
    for (int i : mode) active_.push_back(i);
    const int k = static_cast<int>(active_.size());
    active_jacobian_.resize(k, d_);
    force_map_.resize(k, d_);
    delassus_inverse_.resize(k, k);
    bias_.setZero(k);
    active_residual_.resize(k, 2 * d_);
    active_force_jacobian_.resize(k, 2 * d_);
  }
  if (!(constant_ && factorized_)) mass_factor_.compute(mass_);
  inverse_.setIdentity(d_, d_);
  mass_factor_.solveInPlace(inverse_);
  if (mass_factor_.info() != Eigen::Success) {
    inverse_.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  const int k = static_cast<int>(active_.size());
  if (k > 0) {
    system_.Constraints(q, v, &terms_);
    for (int i = 0; i < k; ++i) {
      active_jacobian_.row(i) = terms_.jacobian.row(active_[i]);
      bias_(i) = terms_.bias(active_[i]);
    }
    // force_map_ holds A_J M⁻¹ until Λ_J is known.
    force_map_.noalias() = active_jacobian_.lazyProduct(inverse_);
    delassus_inverse_.noalias() = force_map_.lazyProduct(active_jacobian_.transpose());
    delassus_factor_.compute(delassus_inverse_);
    delassus_inverse_.setIdentity();
    delassus_factor_.solveInPlace(delassus_inverse_);
    if (delassus_factor_.info() != Eigen::Success) {
      delassus_inverse_.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    // P_J = M⁻¹ − (A_J M⁻¹)ᵀ Λ_J (A_J M⁻¹); the mass inverse is symmetric.
    for (int i = 0; i < k; ++i) {
      for (int j = 0; j < k; ++j) {
        for (int c = 0; c < d_; ++c) {
          const double scale = delassus_inverse_(i, j) * force_map_(j, c);
          for (int r = 0; r < d_; ++r) inverse_(r, c) -= force_map_(i, r) * scale;
        }
      }
    }
    delassus_factor_.solveInPlace(force_map_);
  }
  mode_ = mode;
  factorized_ = true;
}

void ContactDynamics::Evaluate(const VectorRef& x, ContactMode mode) {
  ++evaluations_;
  Factorize(x, mode);
  WithFixedSize(d_, [&](auto d) {
    const double* __restrict column = inverse_.data();
    double* __restrict a = acceleration_.data();
    for (int r = 0; r < d; ++r) a[r] = 0;
    for (int k = 0; k < d; ++k, column += d) {
      const double factor = applied_(k);
      for (int r = 0; r < d; ++r) a[r] += factor * column[r];
    }
  });
  force_.setZero();
  for (int i = 0; i < static_cast<int>(active_.size()); ++i) {
    double lambda = -force_map_.row(i).dot(applied_);
    if (!constant_) {
      lambda -= delassus_inverse_.row(i).dot(bias_);
      acceleration_ -= force_map_.row(i).transpose() * bias_(i);
    }
    force_(active_[i]) = lambda;
  }
}

Vector ContactDynamics::Field(const VectorRef& x, ContactMode mode) {
  Evaluate(x, mode);
  Vector xdot(2 * d_);
  xdot << x.tail(d_), acceleration_;
  return xdot;
}

void ContactDynamics::Differentiate(const VectorRef& x, ContactMode mode) {
  Evaluate(x, mode);
  system_.DifferentiateDynamics(x.head(d_), x.tail(d_), u_, acceleration_, force_, &residual_);
  MultiplySmall(-1, inverse_, residual_.momentum_q, &acceleration_jacobian_(0, 0), d_);
  MultiplySmall(-1, inverse_, residual_.momentum_v, &acceleration_jacobian_(0, d_), d_);
  force_jacobian_.setZero();
  const int k = static_cast<int>(active_.size());
  if (k == 0) return;
  MultiplySmall(1, force_map_, residual_.momentum_q, &active_force_jacobian_(0, 0), k);
  MultiplySmall(1, force_map_, residual_.momentum_v, &active_force_jacobian_(0, d_), k);
  if (!constant_) {
    for (int i = 0; i < k; ++i) {
      active_residual_.row(i).head(d_) = residual_.constraint_q.row(active_[i]);
      active_residual_.row(i).tail(d_) = residual_.constraint_v.row(active_[i]);
    }
    active_force_jacobian_.noalias() -= delassus_inverse_.lazyProduct(active_residual_);
    acceleration_jacobian_.noalias() -= force_map_.transpose().lazyProduct(active_residual_);
  }
  for (int i = 0; i < k; ++i) force_jacobian_.row(active_[i]) = active_force_jacobian_.row(i);
}

Vector ContactDynamics::ForceRate(const VectorRef& x, ContactMode mode) {
  Differentiate(x, mode);
  return force_jacobian_.leftCols(d_) * x.tail(d_) + force_jacobian_.rightCols(d_) * acceleration_;
}

double ContactDynamics::ForceRate(const VectorRef& x, ContactMode mode, int i) {
  Differentiate(x, mode);
  return force_jacobian_.row(i).head(d_).dot(x.tail(d_)) +
         force_jacobian_.row(i).tail(d_).dot(acceleration_);
}

void Delassus(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u, ContactMode C,
              Matrix* G, Vector* b) {
  const int d = system.dof(), k = C.Size();
  G->resize(k, k);
  b->resize(k);
  if (k == 0) return;
  Matrix mass;
  Vector applied;
  ConstraintTerms terms;
  system.Dynamics(x.head(d), x.tail(d), u, &mass, &applied);
  system.Constraints(x.head(d), x.tail(d), &terms);
  Matrix A(k, d);
  int row = 0;
  for (int i : C) {
    A.row(row) = terms.jacobian.row(i);
    (*b)(row) = terms.bias(i);
    ++row;
  }
  const Eigen::LLT<Matrix> factor(mass);
  *G = A * factor.solve(A.transpose());
  *b += A * factor.solve(applied);
}

ContactMode SelectContactMode(ContactDynamics* dynamics, const VectorRef& x, ContactMode candidates,
                              double time_tolerance) {
  if (candidates.Empty()) return candidates;
  Matrix G;
  Vector b;
  Delassus(dynamics->system(), x, dynamics->u(), candidates, &G, &b);
  const ComplementaritySolution solution = SolveComplementarity(G, b);
  // λ_i of the members, and (up to coupling) of the others what their force would be.
  const Vector force =
      solution.z - ((G * solution.z + b).array() / G.diagonal().array()).matrix();
  const double doubtful = kNearZero * (1 + force.cwiseAbs().maxCoeff());
  ContactMode mode, near_zero;
  int row = 0;
  for (int i : candidates) {
    if (solution.support.Contains(row)) mode.Insert(i);
    if (std::abs(force(row)) <= doubtful) near_zero.Insert(i);
    ++row;
  }
  for (int i : near_zero) {
    const ContactMode with = mode.With(i);
    const double rate = dynamics->ForceRate(x, with, i);
    const double rounding = kForceRounding * (1 + dynamics->force().cwiseAbs().maxCoeff());
    if (std::abs(dynamics->force()(i)) > time_tolerance * std::abs(rate) + rounding) continue;
    mode = rate > 0 ? with : mode.Without(i);
  }
  return mode;
}

}  // namespace contact_flow
