// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/contact_dynamics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/fixed_size.h"
#include "contact_flow/model/row_layout.h"
#include "row_solve.h"
#include "solve_columns.h"

namespace contact_flow {
namespace {

/// Loops over as many unroll (WithFixedSize).
constexpr int kFewCoordinates = 8;

/// out = sign · A B [rows×columns] for small matrices, where B has many zeros;
/// `out` must not alias.
void MultiplySmall(double sign, const Matrix& A, const Matrix& B, double* out, int stride) {
  WithFixedSize(static_cast<int>(A.rows()), [&](auto rows) {
    if constexpr (std::is_same_v<decltype(rows), int>) {
      for (int c = 0; c < B.cols(); ++c, out += stride) {
        ColumnSum sum(rows, out);
        for (int k = 0; k < A.cols(); ++k) {
          if (B(k, c) != 0) sum.Add(sign * B(k, c), A.col(k).data());
        }
      }
    } else {
      MultiplyFixedRows(rows, sign, A, B, out, stride);
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

ContactDynamics::~ContactDynamics() = default;

void ContactDynamics::SetMode(const ContactMode& mode) {
  auto kept = std::find_if(modes_.begin(), modes_.end(),
                           [mode](const ModeFactors& factors) { return factors.mode == mode; });
  const bool is_new = kept == modes_.end();
  if (is_new && modes_.size() < kMaxKeptModes) {
    modes_.emplace_front();
  } else {
    if (is_new) --kept;  // what was not used for longest makes room
    modes_.splice(modes_.begin(), modes_, kept);
  }
  at_ = &modes_.front();
  force_.setZero();  // other rows than the mode's stay so
  if (!is_new) return;
  at_->mode = mode;
  at_->known = false;
  at_->active.clear();
  RowLayout(system_).AddClosed(mode - system_.compliant(), &at_->active);
  at_->sliding.clear();
  at_->turning = false;
  at_->dependent = false;
  at_->shared = at_->springs = ConstraintSet();
  if (system_.HasFriction()) AddFriction();
  const int k = static_cast<int>(at_->active.size());
  at_->jacobian.resize(k, d_);
  at_->reach.resize(d_, k);
  at_->momentum_map.resize(k, d_);
  at_->force_map.resize(k, d_);
  at_->delassus_inverse.resize(k, k);
  at_->bias.setZero(k);
  at_->multiplier.setZero(k);
  at_->residual.setZero(k, 2 * d_ + k_);
  at_->force_jacobian.resize(k, 2 * d_ + k_);
}

void ContactDynamics::Factorize(const VectorRef& x) {
  if (!has_mass_) mass_factor_.Compute(mass_);
  has_mass_ = constant_;
  at_->regular = mass_factor_.regular();
  at_->poor = false;
  const int k = static_cast<int>(at_->active.size());
  if (k == 0) return;
  if (constant_) {  // they stay, and other modes come back to them
    system_.Constraints(x.head(nq_), x.tail(d_), &terms_);
  } else {
    system_.ConstraintsOf(at_->mode, x.head(nq_), x.tail(d_), &terms_);
  }
  for (int i = 0; i < k; ++i) {
    at_->jacobian.row(i) = terms_.jacobian.row(at_->active[i]);
    at_->bias(i) = terms_.bias(at_->active[i]);
    at_->reach.col(i) = at_->jacobian.row(i);
    mass_factor_.SolveL(at_->reach.col(i));
  }
  if (!at_->sliding.empty()) return FactorizeSliding(x);
  if (mass_factor_.sparse()) {
    MultiplySparseColumns(at_->reach, &at_->delassus_inverse);
  } else {
    at_->delassus_inverse.noalias() = at_->reach.transpose().lazyProduct(at_->reach);
  }
  at_->delassus_factor.compute(at_->delassus_inverse);
  at_->dependent = system_.HasFriction() && FindDependence();
  if (at_->dependent) return;
  at_->regular = at_->regular && at_->delassus_factor.info() == Eigen::Success;
  at_->poor = at_->regular && IsPoor();
}

void ContactDynamics::Invert() {
  // A constant M⁻¹ is that of the mode without rows, where it is kept.
  const auto free = std::find_if(modes_.begin(), modes_.end(), [](const ModeFactors& factors) {
    return factors.known && factors.active.empty();
  });
  if (free != modes_.end() && free->regular) {
    at_->inverse = free->inverse;
  } else {
    at_->inverse.setIdentity(d_, d_);
    mass_factor_.Solve(&at_->inverse);
  }
  if (!at_->active.empty()) {
    at_->delassus_inverse.setIdentity();
    if (at_->dependent) at_->delassus_inverse = at_->generalized;
    if (mass_factor_.sparse() && at_->sliding.empty() && !at_->dependent) {
      InvertSparse();
    } else if (at_->sliding.empty()) {
      at_->momentum_map.noalias() = at_->jacobian.lazyProduct(at_->inverse);
      if (!at_->dependent) SolveColumns(at_->delassus_factor, &at_->delassus_inverse);
      at_->force_map.noalias() = at_->delassus_inverse.lazyProduct(at_->momentum_map);
      at_->inverse.noalias() -= at_->momentum_map.transpose().lazyProduct(at_->force_map);
    } else {
      at_->momentum_map.noalias() = at_->jacobian.lazyProduct(at_->inverse);
      if (!at_->dependent) {
        at_->delassus_inverse = at_->sliding_factor.solve(at_->delassus_inverse).eval();
      }
      at_->force_map.noalias() = at_->delassus_inverse.lazyProduct(at_->momentum_map);
      at_->response = at_->push;
      mass_factor_.SolveLTransposed(&at_->response);  // M⁻¹ W
      at_->inverse.noalias() -= at_->response.lazyProduct(at_->force_map);
      at_->response = (at_->response * at_->delassus_inverse).eval();
    }
  }
  if (at_->poor) RefineInverse();
  if (at_->regular) return;
  at_->inverse.setConstant(std::numeric_limits<double>::quiet_NaN());
  at_->force_map.setConstant(std::numeric_limits<double>::quiet_NaN());
}

void ContactDynamics::Evaluate(const VectorRef& x, const ContactMode& mode) {
  ++evaluations_;
  system_.Dynamics(x.head(nq_), x.tail(d_), u_, mode, has_mass_ ? nullptr : &mass_, &applied_);
  if (at_ == nullptr || at_->mode != mode) SetMode(mode);
  if (!at_->known) Factorize(x);
  if (constant_ && !at_->known) Invert();
  at_->known = constant_ && !at_->turning;
  if (constant_) {
    Multiply();
  } else {
    Solve();
  }
  if (!at_->shared.Empty()) ShareForces();
  for (std::size_t i = 0; i < at_->active.size(); ++i) force_(at_->active[i]) = at_->multiplier(i);
  if (!at_->sliding.empty()) AddSlidingForce();
}

/// The bias of constant constraints is zero.
void ContactDynamics::Multiply() {
  WithFixedSize(d_, [&](auto d) {
    const double* column = at_->inverse.data();
    ColumnSum sum(d, acceleration_.data());
    for (int k = 0; k < d; ++k, column += d) sum.Add(applied_(k), column);
    sum.WriteTo(acceleration_.data());
  });
  WithFixedSize(static_cast<int>(at_->multiplier.size()), [&](auto rows) {
    const double* column = at_->force_map.data();
    ColumnSum sum(rows, at_->multiplier.data());
    for (int k = 0; k < d_; ++k, column += rows) sum.Add(-applied_(k), column);
    sum.WriteTo(at_->multiplier.data());
  });
}

void ContactDynamics::Solve() {
  acceleration_ = applied_;
  mass_factor_.SolveL(acceleration_);  // y
  if (!at_->active.empty()) {
    at_->multiplier = -at_->bias;
    at_->multiplier.noalias() -= at_->reach.transpose().lazyProduct(acceleration_);
    if (at_->dependent) {
      at_->multiplier = (at_->generalized * at_->multiplier).eval();
    } else if (at_->sliding.empty()) {
      at_->delassus_factor.solveInPlace(at_->multiplier);
    } else {
      at_->multiplier = at_->sliding_factor.solve(at_->multiplier).eval();
    }
    if (at_->sliding.empty()) {
      acceleration_.noalias() += at_->reach.lazyProduct(at_->multiplier);
    } else {
      acceleration_.noalias() += at_->push.lazyProduct(at_->multiplier);
    }
  }
  mass_factor_.SolveLTransposed(acceleration_);
  if (at_->poor) RefineSolution();
  if (at_->regular) return;
  acceleration_.setConstant(std::numeric_limits<double>::quiet_NaN());
  at_->multiplier.setConstant(std::numeric_limits<double>::quiet_NaN());
}

Vector ContactDynamics::Field(const VectorRef& x, const ContactMode& mode) {
  Evaluate(x, mode);
  Vector field(2 * d_ + k_);
  field << x.tail(d_), acceleration_, Vector::Zero(k_);
  return field;
}

void ContactDynamics::Differentiate(const VectorRef& x, const ContactMode& mode) {
  Evaluate(x, mode);
  DifferentiateEvaluated(x);
}

void ContactDynamics::DifferentiateEvaluated(const VectorRef& x) {
  const int k = static_cast<int>(at_->active.size());
  // Robots whose feet stick; products of few coordinates are quicker.
  const bool by_rows = !constant_ && system_.HasFriction() && d_ > kFewCoordinates && k > 0 &&
                       at_->sliding.empty() && !at_->dependent && at_->regular && !at_->poor;
  if (!constant_ && !by_rows) Invert();
  const ContactMode mode = at_->mode;
  const auto q = x.head(nq_), v = x.tail(d_);
  // All forces that are possible lead to the same derivatives, but those of the margin, which are
  // those at its own.
  if (!at_->shared.Empty()) FindShare();
  const Vector& force = at_->shared.Empty() ? force_ : interior_;
  system_.DifferentiateDynamicsOfMode(q, v, u_, mode, acceleration_, force, &residual_);
  if (k_ > 0) DifferentiateByVariables(x);
  if (!at_->sliding.empty()) DifferentiateDirections(x);
  force_jacobian_.setZero();
  if (by_rows) {
    if (row_solver_ == nullptr) row_solver_ = std::make_unique<RowSolver>();
    row_solver_->Start(at_->active);
    row_solver_->Add(residual_.momentum_q, residual_.constraint_q);
    row_solver_->Add(residual_.momentum_v, residual_.constraint_v);
    if (k_ > 0) {
      variable_constraint_.setZero(n_, k_);
      for (int i = 0; i < k; ++i) {
        variable_constraint_.row(at_->active[i]) = at_->residual.row(i).tail(k_);
      }
      row_solver_->Add(variable_momentum_, variable_constraint_);
    }
    row_solver_->Solve(mass_, at_->jacobian, at_->delassus_factor, &acceleration_jacobian_,
                       &at_->force_jacobian);
    for (int i = 0; i < k; ++i) force_jacobian_.row(at_->active[i]) = at_->force_jacobian.row(i);
    return;
  }
  MultiplySmall(-1, at_->inverse, residual_.momentum_q, &acceleration_jacobian_(0, 0), d_);
  MultiplySmall(-1, at_->inverse, residual_.momentum_v, &acceleration_jacobian_(0, d_), d_);
  if (k_ > 0)
    MultiplySmall(-1, at_->inverse, variable_momentum_, &acceleration_jacobian_(0, 2 * d_), d_);
  if (k == 0) return;
  MultiplySmall(1, at_->force_map, residual_.momentum_q, &at_->force_jacobian(0, 0), k);
  MultiplySmall(1, at_->force_map, residual_.momentum_v, &at_->force_jacobian(0, d_), k);
  if (k_ > 0)
    MultiplySmall(1, at_->force_map, variable_momentum_, &at_->force_jacobian(0, 2 * d_), k);
  if (!constant_ || !variables_.parameters.empty()) {
    for (int i = 0; i < k; ++i) {
      at_->residual.row(i).head(d_) = residual_.constraint_q.row(at_->active[i]);
      at_->residual.row(i).segment(d_, d_) = residual_.constraint_v.row(at_->active[i]);
    }
    if (mass_factor_.sparse()) {  // many coordinates
      at_->force_jacobian.noalias() -= at_->delassus_inverse * at_->residual;
    } else {
      at_->force_jacobian.noalias() -= at_->delassus_inverse.lazyProduct(at_->residual);
    }
    if (at_->sliding.empty() && mass_factor_.sparse()) {
      acceleration_jacobian_.noalias() -= at_->force_map.transpose() * at_->residual;
    } else if (at_->sliding.empty()) {
      acceleration_jacobian_.noalias() -= at_->force_map.transpose().lazyProduct(at_->residual);
    } else {
      acceleration_jacobian_.noalias() -= at_->response.lazyProduct(at_->residual);
    }
  }
  for (int i = 0; i < k; ++i) force_jacobian_.row(at_->active[i]) = at_->force_jacobian.row(i);
  if (!at_->sliding.empty()) DifferentiateSlidingForce();
}

/// ∂r₁ and ∂r₂ by the variables, at the point last evaluated.
void ContactDynamics::DifferentiateByVariables(const VectorRef& x) {
  const int inputs = variables_.inputs ? system_.num_inputs() : 0;
  variable_momentum_.leftCols(inputs) = residual_.momentum_u.leftCols(inputs);
  if (variables_.parameters.empty()) return;
  system_.DifferentiateDynamicsByParameters(x.head(nq_), x.tail(d_), u_, at_->mode, acceleration_,
                                            at_->shared.Empty() ? force_ : interior_,
                                            variables_.parameters, &parameter_residual_);
  variable_momentum_.rightCols(k_ - inputs) = parameter_residual_.momentum;
  for (std::size_t i = 0; i < at_->active.size(); ++i) {
    at_->residual.row(i).tail(k_ - inputs) = parameter_residual_.constraint.row(at_->active[i]);
  }
}

void Delassus(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u,
              const ConstraintSet& C, Matrix* G, Vector* b) {
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
