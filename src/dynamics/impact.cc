// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/impact.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/row_layout.h"

namespace contact_flow {
namespace {

constexpr double kImpactRounding = 1e-13;
/// What is left of velocities that dependent rows are to have, relative to them.
constexpr double kConsistentImpact = 1e-8;

/// M⁻¹ Aᵀ p.
Vector SparseJump(const InverseInertia& inertia, const ConstraintSet& touching, const Vector& p) {
  Vector jump = Vector::Zero(inertia.applied().size());
  Eigen::Index row = 0;
  for (int i : touching) {
    const double impulse = p(row++);
    if (impulse != 0) inertia.sparse_reach().AddRow(i, impulse, jump);
  }
  inertia.mass_factor().SolveLTransposed(jump);
  return jump;
}

/// Whether G = L Lᵀ has no row that depends on those before it.
bool IsDefinite(const Eigen::LLT<Matrix>& factor, const Matrix& G) {
  if (G.rows() > 0 && factor.info() != Eigen::Success) return false;
  for (Eigen::Index i = 0; i < G.rows(); ++i) {
    const double pivot = factor.matrixLLT()(i, i);
    if (!(pivot * pivot > kDependentRow * G(i, i))) return false;
  }
  return true;
}

/// x with M x − Aᵀ p = R, A x = S: by the factors of M and of A M⁻¹ Aᵀ, or, where rows depend on
/// one another (p is not unique, x may be), by pivoting.
Matrix SolveSaddle(const InverseInertia& inertia, const Matrix& A, Matrix R, Matrix S) {
  const MassFactor& mass = inertia.mass_factor();
  Matrix Y = A.transpose();
  mass.Solve(&Y);
  const Matrix G = A.lazyProduct(Y);
  const Eigen::LLT<Matrix> factor(G);
  if (mass.regular() && IsDefinite(factor, G)) {
    if (!R.isZero(0)) {
      mass.Solve(&R);
      S.noalias() -= A.lazyProduct(R);
    }
    for (Eigen::Index c = 0; c < S.cols() && S.rows() > 0; ++c) factor.solveInPlace(S.col(c));
    R.noalias() += Y.lazyProduct(S);
    return R;
  }
  const Eigen::Index d = A.cols(), k = A.rows();
  Matrix kkt = Matrix::Zero(d + k, d + k), rhs(d + k, R.cols());
  kkt.topLeftCorner(d, d) = inertia.mass();
  kkt.topRightCorner(d, k) = -A.transpose();
  kkt.bottomLeftCorner(k, d) = A;
  rhs << R, S;
  return kkt.partialPivLu().solve(rhs).topRows(d);
}

/// p with G p + b = 0; where rows depend on one another the least such one, as v⁺ is the same.
Vector ProjectingImpulses(const Matrix& G, const Vector& b) {
  if (b.size() == 0) return Vector();
  const Eigen::LLT<Matrix> factor(G);
  if (IsDefinite(factor, G)) return -factor.solve(b);
  const Vector scale = G.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::CompleteOrthogonalDecomposition<Matrix> shared;
  shared.setThreshold(kDependentRow);
  shared.compute(scale.asDiagonal() * G * scale.asDiagonal());
  const Vector p = -scale.cwiseProduct(shared.solve(scale.cwiseProduct(b)));
  const double left = scale.cwiseProduct(G * p + b).cwiseAbs().maxCoeff();
  if (!(left <= kConsistentImpact * scale.cwiseProduct(b).cwiseAbs().maxCoeff())) {
    throw std::domain_error(
        "no impulses give the touching constraints their velocities after the impact, which depend "
        "on one another (Assumption 3): their restitutions contradict each other, or the mass is "
        "indefinite");
  }
  return p;
}

}  // namespace

ImpactResult SolveImpact(const MechanicalSystem& system, const VectorRef& q,
                         const VectorRef& v_minus, const ConstraintSet& touching, ImpactLaw law) {
  return SolveImpact(system, InverseInertia(system, q, v_minus), v_minus, touching, law);
}

ImpactResult SolveImpact(const MechanicalSystem& system, const InverseInertia& inertia,
                         const VectorRef& v_minus, const ConstraintSet& touching, ImpactLaw law) {
  const int k = touching.Size();
  const bool many = inertia.mass_factor().sparse() && inertia.mass_factor().regular() &&
                    system.num_bilateral() == 0;
  const Matrix A = many ? Matrix() : inertia.Rows(touching);
  const Matrix Y = many ? Matrix() : inertia * A.transpose();  // P Aᵀ [d×k]
  const Matrix G = many ? inertia.Delassus(touching) : Matrix(A * Y);
  Vector b = many ? Vector(k) : Vector(A * v_minus);
  int row = 0;
  for (int i : touching) {
    if (many) b(row) = inertia.sparse_jacobian().Dot(i, v_minus);
    b(row++) *= 1 + system.restitution()(i);
  }
  Vector p;
  if (law == ImpactLaw::kProjection) {
    p = ProjectingImpulses(G, b);
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
  result.v_plus = v_minus + (many ? SparseJump(inertia, touching, p) : Vector(Y * p));
  if (!result.v_plus.allFinite()) {
    throw std::domain_error("the velocity after the impact is not finite");
  }
  result.impulse = Vector::Zero(system.num_rows());
  const double zero = k > 0 ? kImpactRounding * b.cwiseAbs().maxCoeff() : 0;
  row = 0;
  for (int i : touching) {
    result.impulse(i) = p(row);
    if (std::abs(p(row)) * G(row, row) > zero) result.hit.Insert(i);
    ++row;
  }
  if (many || system.num_bilateral() == 0) return result;
  RowLayout(system).Bilateral(result.impulse) =
      inertia.BilateralForce(Matrix(A.transpose() * p)).col(0);
  return result;
}

Matrix ImpactJacobian(const MechanicalSystem& system, const InverseInertia& inertia,
                      const VectorRef& q, const VectorRef& v_minus, const ImpactResult& result,
                      const ConstraintSet& hit, const ConstraintSet& persisting,
                      const Variables& variables) {
  const int d = system.dof(), n = system.num_constraints();
  const int tangents = 2 * d + variables.Size(system);
  const auto parameters = static_cast<Eigen::Index>(variables.parameters.size());
  const std::vector<int> rows = RowLayout(system).Closed(hit);
  const auto count = static_cast<Eigen::Index>(rows.size());
  const auto restitution = [&](int i) {
    return i >= n || persisting.Contains(i) ? 0 : system.restitution()(i);
  };

  // Unknowns (v⁺ − δv⁻, p):  r₁ = M (v⁺ − v⁻) − Aᵀ p = 0,   r₂ = A (v⁺ + γ v⁻) = 0.
  Matrix A(count, d), momentum = Matrix::Zero(d, tangents), rates = Matrix::Zero(count, tangents);
  bool bounces = parameters > 0;
  for (Eigen::Index row = 0; row < count; ++row) {
    A.row(row) = inertia.terms().jacobian.row(rows[row]);
    rates.row(row).segment(d, d) = -(1 + restitution(rows[row])) * A.row(row);
    bounces = bounces || restitution(rows[row]) != 0;
  }
  // r₂ is linear in the vector it acts on: its derivatives at v⁺ and, times γ, at v⁻.
  const Vector jump = result.v_plus - v_minus;
  ResidualJacobian residual;
  ParameterJacobian by_parameter;
  for (const bool after : {true, false}) {
    if (!after && !bounces) break;
    const Vector s = after ? result.v_plus : Vector(v_minus);
    system.DifferentiateImpact(q, jump, result.impulse, s, &residual);
    if (after) momentum.leftCols(d) = -residual.momentum_q;
    for (Eigen::Index row = 0; row < count; ++row) {
      const double factor = after ? 1 : restitution(rows[row]);
      rates.row(row).head(d) -= factor * residual.constraint_q.row(rows[row]);
    }
    if (parameters == 0) continue;
    system.DifferentiateImpactByParameters(q, jump, result.impulse, s, variables.parameters,
                                           &by_parameter);
    if (after) momentum.rightCols(parameters) = -by_parameter.momentum;
    auto columns = rates.rightCols(parameters);
    for (Eigen::Index row = 0; row < count; ++row) {
      const int i = rows[row];
      columns.row(row) -= (after ? 1 : restitution(i)) * by_parameter.constraint.row(i);
      if (after || i >= n || persisting.Contains(i)) continue;
      columns.row(row) -= by_parameter.restitution.row(i) * A.row(row).dot(v_minus);
    }
  }
  Matrix reset = Matrix::Identity(tangents, tangents);
  reset.middleRows(d, d) += SolveSaddle(inertia, A, std::move(momentum), std::move(rates));
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
  ConstraintSet touching;
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
