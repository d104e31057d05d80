// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {
namespace test {

/// What a random system with friction is made of, any number of contacts; R = 1 row of T a contact
/// in the plane, 2 in space:
///   M constant,   f = f₀ − K q − D v,   a_i = c_i + n_i·q + ½ qᵀ Q_i q,   T(q) = T₀ + Σ_k q_k T_k.
struct ContactCoefficients {
  int rows = 1;                    ///< R
  Matrix mass;                     ///< M [d×d]
  Vector load;                     ///< f₀ [d]
  Matrix stiffness, damping;       ///< K, D [d×d]
  Vector offset;                   ///< c [n]
  Matrix normals;                  ///< n_i [n×d]
  std::vector<Matrix> curvatures;  ///< Q_i [d×d], n of them, symmetric
  Matrix tangents;                 ///< T₀ [nR×d]
  std::vector<Matrix> turning;     ///< T_k [nR×d], d of them
  Vector friction;                 ///< μ [n], +∞: no slip
  Vector restitution;              ///< γ [n]
};

/// The system of such coefficients. Parameters: mu_i and gamma_i.
class RandomContacts : public MechanicalSystem {
 public:
  explicit RandomContacts(ContactCoefficients coefficients);

  const ContactCoefficients& coefficients() const { return c_; }
  bool HasConstantMass() const override { return true; }
  void Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u, const ContactMode& mode,
                Matrix* mass, Vector* force) const override;
  void Constraints(const VectorRef& q, const VectorRef& v, ConstraintTerms* terms) const override;
  void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                             const ContactMode& mode, const VectorRef& acceleration,
                             const VectorRef& force, ResidualJacobian* jacobian) const override;
  void DifferentiateImpact(const VectorRef& q, const VectorRef& jump, const VectorRef& impulse,
                           const VectorRef& s, ResidualJacobian* jacobian) const override;
  void DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                         const ContactMode& mode, const VectorRef& acceleration,
                                         const VectorRef& force, const std::vector<int>& parameters,
                                         ParameterJacobian* jacobian) const override;
  void DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                       const VectorRef& impulse, const VectorRef& s,
                                       const std::vector<int>& parameters,
                                       ParameterJacobian* jacobian) const override;
  Matrix DifferentiateFriction(const std::vector<int>& parameters) const override;

 private:
  int contacts() const { return static_cast<int>(c_.offset.size()); }
  /// ∂(J s)/∂q for fixed s [n+r × d], J all rows.
  Matrix Turned(const VectorRef& s) const;
  /// ∂(Jᵀ λ)/∂q for fixed λ [d×d].
  Matrix Pushed(const VectorRef& force) const;

  ContactCoefficients c_;
};

}  // namespace test
}  // namespace contact_flow
