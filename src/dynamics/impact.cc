// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/impact.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <stdexcept>
#include <vector>

namespace contact_flow {
namespace {

constexpr double kRounding = 1e-13;

}  // namespace

ImpactResult SolveImpact(const MechanicalSystem& system, const VectorRef& q, const VectorRef& v_minus,
                         ContactMode touching, ImpactLaw law) {
  const int d = system.dof(), k = touching.Size();
  Matrix mass;
  Vector applied;
  ConstraintTerms terms;
  system.Dynamics(q, v_minus, Vector::Zero(system.num_inputs()), &mass, &applied);
  system.Constraints(q, v_minus, &terms);
  Matrix A(k, d);
  Vector b(k);
  int row = 0;
  for (int i : touching) {
    A.row(row) = terms.jacobian.row(i);
    b(row) = (1 + system.restitution()(i)) * A.row(row).dot(v_minus);
    ++row;
  }
  const Eigen::LLT<Matrix> factor(mass);
  const Matrix Y = factor.solve(A.transpose());  // M⁻¹ Aᵀ [d×k]
  const Matrix G = A * Y;
  Vector p;
  if (law == ImpactLaw::kProjection) {
    p = -G.llt().solve(b);
  } else {
    const ComplementaritySolution solution = SolveComplementarity(G, b);
    if (!solution.found) {
      throw std::domain_error("the touching constraints are dependent at an impact (Assumption 3)");
    }
    p = solution.z;
  }
  ImpactResult result;
  result.v_plus = v_minus + Y * p;
  result.impulse = Vector::Zero(system.num_constraints());
  const double zero = k > 0 ? kRounding * b.cwiseAbs().maxCoeff() : 0;
  row = 0;
  for (int i : touching) {
    result.impulse(i) = p(row);
    if (std::abs(p(row)) * G(row, row) > zero) result.hit.Insert(i);
    ++row;
  }
  return result;
}

Matrix ImpactJacobian(const MechanicalSystem& system, const VectorRef& q, const VectorRef& v_minus,
                      const ImpactResult& result, ContactMode hit, ContactMode persisting) {
  const int d = system.dof(), k = hit.Size();
  Matrix mass;
  Vector applied;
  ConstraintTerms terms;
  system.Dynamics(q, v_minus, Vector::Zero(system.num_inputs()), &mass, &applied);
  system.Constraints(q, v_minus, &terms);

  // Unknowns (v⁺, p_hit):  r₁ = M (v⁺ − v⁻) − Aᵀ p = 0,   r₂ = A (v⁺ + γ v⁻) = 0.
  Matrix kkt = Matrix::Zero(d + k, d + k);
  Matrix rhs = Matrix::Zero(d + k, 2 * d);
  ResidualJacobian residual;
  const Vector jump = result.v_plus - v_minus;
  system.DifferentiateImpact(q, jump, result.impulse, result.v_plus, &residual);
  kkt.topLeftCorner(d, d) = mass;
  rhs.topLeftCorner(d, d) = -residual.momentum_q;
  rhs.topRightCorner(d, d) = mass;
  int row = d;
  for (int i : hit) {
    const double gamma = persisting.Contains(i) ? 0 : system.restitution()(i);
    kkt.row(row).head(d) = terms.jacobian.row(i);
    kkt.col(row).head(d) = -terms.jacobian.row(i).transpose();
    rhs.row(row).head(d) = -residual.constraint_q.row(i);
    rhs.row(row).tail(d) = -gamma * terms.jacobian.row(i);
    ++row;
  }
  // The part γ D_q(A) v⁻ of r₂ is linear in its last argument.
  system.DifferentiateImpact(q, jump, result.impulse, v_minus, &residual);
  row = d;
  for (int i : hit) {
    const double gamma = persisting.Contains(i) ? 0 : system.restitution()(i);
    rhs.row(row).head(d) -= gamma * residual.constraint_q.row(i);
    ++row;
  }
  const Matrix solution = kkt.partialPivLu().solve(rhs);
  Matrix reset = Matrix::Identity(2 * d, 2 * d);
  reset.bottomRows(d) = solution.topRows(d);
  return reset;
}

}  // namespace contact_flow
