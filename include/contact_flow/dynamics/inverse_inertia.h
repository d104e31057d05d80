// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <memory>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/mass_factor.h"
#include "contact_flow/dynamics/sparse_rows.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The inverse inertia at one configuration as the contacts see it, inside the
/// bilateral constraints:
///   P = M⁻¹ − M⁻¹ Bᵀ (B M⁻¹ Bᵀ)⁻¹ B M⁻¹ [d×d],       B = Db(q) [l×d];
/// P = M⁻¹ where there are none. G = A P Aᵀ is the Delassus matrix of the contacts, so that
/// orthogonality is judged inside the constraint manifold. Inertias that are not positive definite,
/// and dependent bilateral constraints, give NaN, which SolveComplementarity, SolveImpact,
/// PlasticImpact and SelectMode refuse.
class InverseInertia {
 public:
  InverseInertia(const MechanicalSystem& system, const VectorRef& q, const VectorRef& v,
                 const VectorRef& u, const ContactMode& mode);
  /// For what depends on the configuration alone.
  InverseInertia(const MechanicalSystem& system, const VectorRef& q, const VectorRef& v);

  const Matrix& mass() const { return mass_; }
  const MassFactor& mass_factor() const { return mass_factor_; }  ///< M = L Lᵀ
  /// f + c v [d].
  const Vector& applied() const { return applied_; }
  const ConstraintTerms& terms() const { return terms_; }
  /// Rows of Da over the members of a set [k×d].
  Matrix Rows(const ConstraintSet& members) const;
  /// P R, for R [d×·].
  Matrix operator*(const MatrixRef& R) const;
  /// Of a set, A P Aᵀ [k×k].
  Matrix Delassus(const ConstraintSet& members) const;
  /// Where M has many zeros: Da, and a row (L⁻¹Da_iᵀ)ᵀ for each contact [n×d].
  const SparseRows& sparse_jacobian() const { return Sparse().jacobian; }
  const SparseRows& sparse_reach() const { return Sparse().reach; }
  /// −(B M⁻¹ Bᵀ)⁻¹ B M⁻¹ R [l×·]: what the bilateral constraints answer to R.
  Matrix BilateralForce(const MatrixRef& R) const;
  /// The acceleration without contact [d]: P (f + c v) − M⁻¹ Bᵀ (B M⁻¹ Bᵀ)⁻¹ Ḃ v.
  Vector FreeAcceleration() const;
  /// The shortest step in the kinetic metric that changes (b, or B v) by −r [l]: M⁻¹Bᵀ(BM⁻¹Bᵀ)⁻¹
  /// (−r) [d].
  Vector Correction(const VectorRef& r) const;

 private:
  const int n_;
  bool regular_ = false;  // both factors exist
  Matrix mass_;
  Vector applied_;
  ConstraintTerms terms_;
  MassFactor mass_factor_;
  Matrix reach_;  // M⁻¹ Bᵀ [d×l]
  Eigen::LLT<Matrix> bilateral_factor_;
  /// Of all contacts, where M has many zeros: when asked for.
  struct SparseTerms {
    SparseRows jacobian, reach;
    Matrix delassus;
  };
  const SparseTerms& Sparse() const;
  mutable std::shared_ptr<const SparseTerms> sparse_;
};

}  // namespace contact_flow
