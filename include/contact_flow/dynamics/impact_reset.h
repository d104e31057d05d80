// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <memory>
#include <utility>
#include <vector>

#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/inverse_inertia.h"

namespace contact_flow {

/// DR of ImpactJacobian, as a product where M has many zeros (MassFactor) and no parameter is
/// varied: one direction is the solution of
///   M x − Aᵀ π = M w_v − ∂r₁/∂q w_q,   A x = −∂r₂/∂q w_q − γ A w_v,
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
    Matrix momentum_q;  ///< ∂r₁/∂q [d×d]
    Matrix after_q;     ///< ∂(Da v⁺)/∂q [n+l+r × d]
    Matrix before_q;    ///< ∂(Da v⁻)/∂q, as after_q
    int tangents;       ///< 2d and the variables, which are kept
  };

  ImpactReset() = default;
  /// The identity.
  explicit ImpactReset(int tangents) : matrix_(Matrix::Identity(tangents, tangents)) {}
  /// DR as it is.
  explicit ImpactReset(Matrix DR) : matrix_(std::move(DR)) {}
  /// `hit` and `persisting` as in ImpactJacobian.
  ImpactReset(std::shared_ptr<const Terms> terms, ContactMode hit, ContactMode persisting);

  Vector operator*(const Vector& w) const;
  const Matrix& matrix() const;

 private:
  /// ∂v⁺ for the columns of (w_q, w_v) [2d×·].
  Matrix Velocities(const MatrixRef& w) const;

  std::shared_ptr<const Terms> terms_;  // null where it is a matrix from the beginning
  std::vector<int> rows_;
  Vector restitution_;  // γ of the rows
  Matrix reach_;        // L⁻¹Aᵀ
  Eigen::LLT<Matrix> factor_;
  mutable Matrix matrix_;
};

}  // namespace contact_flow
