// SPDX-License-Identifier: BSD-3-Clause
#include "rest_impulse.h"

#include <Eigen/QR>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/model/row_layout.h"

namespace contact_flow {
namespace {

/// Along what contact i, which slips, is pushed tangentially: −μ d, with d = T v/|T v|.
Vector FrictionAlong(const Friction& friction, Letter letter, const VectorRef& slip) {
  if (friction.dimension == 1) {
    return Vector::Constant(1, -friction.coefficient * SlipSign(letter));
  }
  return -friction.coefficient * slip.normalized();
}

}  // namespace

std::vector<RestingRow> RestingRows(const MechanicalSystem& system, const Matrix& A,
                                    const VectorRef& v, const ContactMode& mode) {
  std::vector<RestingRow> rows;
  for (int i : mode - system.compliant()) {
    const Friction& friction = system.friction()[i];
    RestingRow normal{i, A.row(i).transpose()};
    const auto T = A.middleRows(friction.row, friction.dimension);
    const bool sticks = mode.LetterOf(i) == Letter::kStick;
    if (!sticks && friction.dimension > 0 && friction.coefficient > 0) {
      normal.push += T.transpose() * FrictionAlong(friction, mode.LetterOf(i), T * v);
    }
    rows.push_back(normal);
    for (int k = 0; sticks && k < friction.dimension; ++k) {
      rows.push_back({friction.row + k, T.row(k).transpose()});
    }
  }
  return rows;
}

RestImpulse BringToRest(const MechanicalSystem& system, const InverseInertia& inertia,
                        const VectorRef& v, const ContactMode& mode) {
  const Matrix& A = inertia.terms().jacobian;
  const std::vector<RestingRow> rows = RestingRows(system, A, v, mode);
  RestImpulse rest{v, Vector::Zero(system.num_rows())};
  if (rows.empty()) return rest;
  const auto m = static_cast<Eigen::Index>(rows.size());
  Matrix active(m, v.size()), push(v.size(), m);
  for (Eigen::Index k = 0; k < m; ++k) {
    active.row(k) = A.row(rows[static_cast<std::size_t>(k)].row);
    push.col(k) = rows[static_cast<std::size_t>(k)].push;
  }
  const Matrix reach = inertia * push;
  const Vector p = (active * reach).completeOrthogonalDecomposition().solve(Vector(-active * v));
  rest.v_plus += reach * p;
  for (Eigen::Index k = 0; k < m; ++k) {
    const int row = rows[static_cast<std::size_t>(k)].row;
    rest.impulse(row) += p(k);
    if (row >= system.num_constraints() || mode.LetterOf(row) == Letter::kStick) continue;
    const Friction& friction = system.friction()[row];
    if (friction.dimension == 0 || !(friction.coefficient > 0)) continue;
    const Vector slip = A.middleRows(friction.row, friction.dimension) * v;
    rest.impulse.segment(friction.row, friction.dimension) =
        p(k) * FrictionAlong(friction, mode.LetterOf(row), slip);
  }
  RowLayout(system).Bilateral(rest.impulse) = inertia.BilateralForce(Matrix(push * p)).col(0);
  return rest;
}

}  // namespace contact_flow
