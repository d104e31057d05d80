// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {
namespace adversary {

/// Systems have at most this many degrees of freedom.
constexpr int kMaxDof = 16;
/// Of d or n numbers, without the heap.
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxDof, 1>;

/// A function of one combination of coordinates, z = (e·q − centre) / width: a bump exp(−z²) or a
/// wave sin z. Localized forces, forces in a clock coordinate, height fields.
struct Ridge {
  bool bump = true;
  Vector e;  ///< [d]
  double centre = 0;
  double width = 1;

  /// The k-th derivative by e·q, k = 0 … 3.
  double Derivative(const VectorRef& q, int k) const;
  /// Time in which the motion (q, v) comes to see something else of it [s].
  double TimeScale(const VectorRef& q, const VectorRef& v) const;
};

/// a(q) = offset + n·q + ½ qᵀQq + Σ A_r ridge_r(q).
struct GapTerms {
  double offset = 0;
  Vector normal;     ///< [d]
  Matrix curvature;  ///< Q [d×d], symmetric; empty: none
  std::vector<std::pair<double, Ridge>> ridges;
};

/// A force A ridge(q).
struct ForceRidge {
  Vector amplitude;  ///< [d]
  Ridge ridge;
};

/// What a random system is made of, numbers given at run time:
///   M(q) = M₀ + Σ_k sin(q_k) M_k,
///   f = load f₀ + K q + D v + (vᵀC_i v)_i + Σ A_r ridge_r(q) + B u.
struct Coefficients {
  Matrix mass;                      ///< M₀ [d×d]
  std::vector<Matrix> mass_slopes;  ///< M_k [d×d], one a coordinate; none: constant mass
  Vector load;                      ///< f₀ [d]
  Matrix stiffness, damping;        ///< K, D [d×d]
  std::vector<Matrix> quadratic;    ///< C_i [d×d], symmetric; none: zero
  std::vector<ForceRidge> ridges;
  Matrix input;  ///< B [d×m]
  std::vector<GapTerms> gaps;
  Vector restitution;  ///< [n]

  int dof() const { return static_cast<int>(mass.rows()); }
};

/// A mechanical system of coefficients. Parameters: `load`, a factor on f₀, and `shift`, which is
/// added to the first gap.
class RandomSystem : public MechanicalSystem {
 public:
  explicit RandomSystem(Coefficients coefficients, double load = 1, double shift = 0);

  const Coefficients& coefficients() const { return c_; }
  /// Time in which forces and gaps along the motion change by something of their size, as far as
  /// their ridges go [s].
  double TimeScale(const VectorRef& q, const VectorRef& v) const;

  bool HasConstantMass() const override { return c_.mass_slopes.empty(); }
  bool HasAffineConstraints() const override { return affine_; }
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

 private:
  /// Da_i s [d] by q: H_i s.
  Vector HessianTimes(const GapTerms& gap, const VectorRef& q, const VectorRef& s) const;

  Coefficients c_;
  bool affine_ = true;
};

}  // namespace adversary
}  // namespace contact_flow
