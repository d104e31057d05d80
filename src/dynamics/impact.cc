// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/impact.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <optional>
#include <stdexcept>
#include <vector>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {
namespace {

constexpr double kRounding = 1e-13;

}  // namespace

ImpactResult SolveImpact(const MechanicalSystem& system, const VectorRef& q,
                         const VectorRef& v_minus, ContactMode touching, ImpactLaw law) {
  return SolveImpact(system, InverseInertia(system, q, v_minus), v_minus, touching, law);
}

ImpactResult SolveImpact(const MechanicalSystem& system, const InverseInertia& inertia,
                         const VectorRef& v_minus, ContactMode touching, ImpactLaw law) {
  const int k = touching.Size();
  const Matrix A = inertia.Rows(touching);
  Vector b = A * v_minus;
  int row = 0;
  for (int i : touching) b(row++) *= 1 + system.restitution()(i);
  const bool many = inertia.mass_factor().sparse() && system.num_bilateral() == 0;
  const Matrix Y = many ? Matrix() : inertia * A.transpose();  // P Aᵀ [d×k]
  const Matrix G = many ? inertia.Delassus(touching) : Matrix(A * Y);
  Vector p;
  if (law == ImpactLaw::kProjection) {
    const Eigen::LLT<Matrix> factor(G);
    if (k > 0 && factor.info() != Eigen::Success) {
      throw std::domain_error(
          "the impulses of the touching constraints are not unique: they are dependent (Assumption "
          "3), or the mass is indefinite");
    }
    p = k > 0 ? Vector(-factor.solve(b)) : Vector();
  } else {
    const std::optional<ComplementaritySolution> solution = SolveComplementarity(G, b);
    if (!solution) {
      throw std::domain_error(
          "no impulses p >= 0 of the touching constraints end the impact: they are dependent and "
          "jam (Assumption 3), or the mass is indefinite");
    }
    p = solution->z;
  }
  ImpactResult result;
  result.v_plus = v_minus + (many ? Vector(inertia * (A.transpose() * p)) : Vector(Y * p));
  if (!result.v_plus.allFinite()) {
    throw std::domain_error("the velocity after the impact is not finite");
  }
  result.impulse = Vector::Zero(system.num_rows());
  const double zero = k > 0 ? kRounding * b.cwiseAbs().maxCoeff() : 0;
  row = 0;
  for (int i : touching) {
    result.impulse(i) = p(row);
    if (std::abs(p(row)) * G(row, row) > zero) result.hit.Insert(i);
    ++row;
  }
  result.impulse.segment(system.num_constraints(), system.num_bilateral()) =
      inertia.BilateralForce(Matrix(A.transpose() * p)).col(0);
  return result;
}

Matrix ImpactJacobian(const MechanicalSystem& system, const VectorRef& q, const VectorRef& v_minus,
                      const ImpactResult& result, ContactMode hit, ContactMode persisting,
                      const Variables& variables) {
  const int d = system.dof(), n = system.num_constraints(), k = variables.Size(system);
  const int tangents = 2 * d + k;
  const int first_parameter = tangents - static_cast<int>(variables.parameters.size());
  Matrix mass;
  Vector applied;
  ConstraintTerms terms;
  system.Dynamics(q, v_minus, Vector::Zero(system.num_inputs()), ContactMode(), &mass, &applied);
  system.Constraints(q, v_minus, &terms);
  std::vector<int> rows;
  for (int i : hit) rows.push_back(i);
  for (int i = 0; i < system.num_bilateral(); ++i) rows.push_back(n + i);
  const int count = static_cast<int>(rows.size());
  const auto restitution = [&](int i) {
    return i >= n || persisting.Contains(i) ? 0 : system.restitution()(i);
  };

  // Unknowns (v⁺, p):  r₁ = M (v⁺ − v⁻) − Aᵀ p = 0,   r₂ = A (v⁺ + γ v⁻) = 0.
  Matrix kkt = Matrix::Zero(d + count, d + count);
  Matrix rhs = Matrix::Zero(d + count, tangents);
  const Vector jump = result.v_plus - v_minus;
  kkt.topLeftCorner(d, d) = mass;
  rhs.block(0, d, d, d) = mass;
  for (int row = 0; row < count; ++row) {
    kkt.row(d + row).head(d) = terms.jacobian.row(rows[row]);
    kkt.col(d + row).head(d) = -terms.jacobian.row(rows[row]).transpose();
    rhs.row(d + row).segment(d, d) = -restitution(rows[row]) * terms.jacobian.row(rows[row]);
  }
  // r₂ is linear in the vector it acts on: its derivatives at v⁺ and, times γ, at v⁻.
  ResidualJacobian residual;
  ParameterJacobian by_parameter;
  for (const bool after : {true, false}) {
    const Vector s = after ? result.v_plus : Vector(v_minus);
    system.DifferentiateImpact(q, jump, result.impulse, s, &residual);
    if (after) rhs.topLeftCorner(d, d) = -residual.momentum_q;
    for (int row = 0; row < count; ++row) {
      const double factor = after ? 1 : restitution(rows[row]);
      rhs.row(d + row).head(d) -= factor * residual.constraint_q.row(rows[row]);
    }
    if (variables.parameters.empty()) continue;
    system.DifferentiateImpactByParameters(q, jump, result.impulse, s, variables.parameters,
                                           &by_parameter);
    auto columns = rhs.rightCols(tangents - first_parameter);
    if (after) columns.topRows(d) = -by_parameter.momentum;
    for (int row = 0; row < count; ++row) {
      const int i = rows[row];
      columns.row(d + row) -= (after ? 1 : restitution(i)) * by_parameter.constraint.row(i);
      if (after || i >= n || persisting.Contains(i)) continue;
      columns.row(d + row) -= by_parameter.restitution.row(i) * terms.jacobian.row(i).dot(v_minus);
    }
  }
  Matrix reset = Matrix::Identity(tangents, tangents);
  reset.middleRows(d, d) = kkt.partialPivLu().solve(rhs).topRows(d);
  if (!reset.allFinite()) {
    throw std::domain_error("an impact has no derivative: its constraints are dependent");
  }
  return reset;
}

Vector PushedVelocity(const MechanicalSystem& system, const VectorRef& x, const VectorRef& impulse,
                      double gap_tolerance, ImpactLaw law) {
  const int nq = system.num_positions(), d = system.dof();
  const InverseInertia inertia(system, x.head(nq), x.tail(d));
  const Vector pushed = x.tail(d) + inertia * impulse;
  ContactMode touching;
  for (int i = 0; i < system.num_constraints(); ++i) {
    const bool rigid = !system.compliant().Contains(i);
    if (rigid && inertia.terms().gap(i) <= gap_tolerance) touching.Insert(i);
  }
  if (touching.Empty()) return pushed;
  if (system.HasFriction()) {
    return SolveFrictionalImpact(system, x.head(nq), pushed, touching).result.v_plus;
  }
  return SolveImpact(system, x.head(nq), pushed, touching, law).v_plus;
}

}  // namespace contact_flow
