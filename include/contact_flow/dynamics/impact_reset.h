// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <memory>
#include <utility>
#include <vector>

#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/sparse_rows.h"

namespace contact_flow {

/// DR of ImpactJacobian, as a product where M has many zeros (MassFactor) and no parameter is
/// varied: one direction is the solution of
///   M (x − w_v) − Aᵀ π = −∂r₁/∂q w_q,   A x = −∂r₂/∂q w_q − γ A w_v,
/// by the factors of M and of A M⁻¹ Aᵀ; the matrix is made when it is asked for.
class ImpactReset {
 public:
  /// What resets of one impact have in common.
  struct Terms {
    /// Whether products are computed by the factors.
    static bool Allowed(const MechanicalSystem& system, const InverseInertia& inertia,
                        const Variables& variables);

    const MechanicalSystem& system;
    std::shared_ptr<const InverseInertia> inertia;
    SparseRows momentum_q;  ///< ∂r₁/∂q [d×d]
    SparseRows after_q;     ///< ∂(Da v⁺)/∂q [n+l+r × d]
    SparseRows before_q;    ///< ∂(Da v⁻)/∂q, as after_q
    int tangents;           ///< 2d and the variables, which are kept
  };

  ImpactReset() = default;
  /// The identity.
  explicit ImpactReset(int tangents) : matrix_(Matrix::Identity(tangents, tangents)) {}
  /// DR as it is.
  explicit ImpactReset(Matrix DR) : matrix_(std::move(DR)) {}
  /// `hit` and `persisting` as in ImpactJacobian.
  ImpactReset(std::shared_ptr<const Terms> terms, const ConstraintSet& hit,
              const ConstraintSet& persisting);

  Vector operator*(const Vector& w) const;
  Matrix operator*(const Matrix& W) const;
  const Matrix& matrix() const;
  /// ∂v⁺/∂q [d×d].
  Matrix ByConfiguration(int d) const;

 private:
  /// δv⁺ [d] for (w_q, w_v).
  Vector Velocity(const VectorRef& w_q, const VectorRef& w_v) const;

  std::shared_ptr<const Terms> terms_;  // null where it is a matrix from the beginning
  std::vector<int> rows_;
  Vector restitution_;                                // γ of the rows
  std::shared_ptr<const Eigen::LLT<Matrix>> factor_;  // of A M⁻¹ Aᵀ over the rows
  mutable Matrix matrix_;
};

}  // namespace contact_flow
