// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/sticking.h"

#include <Eigen/Cholesky>

namespace contact_flow {

ImpactResult Stick(const MechanicalSystem& system, const VectorRef& q, const VectorRef& v_minus,
                   ContactMode J) {
  Matrix mass;
  Vector unused;
  ConstraintTerms terms;
  system.Dynamics(q, v_minus, Vector::Zero(system.num_inputs()), &mass, &unused);
  system.Constraints(q, v_minus, &terms);
  Matrix A(J.Size(), system.dof());
  int row = 0;
  for (int i : J) A.row(row++) = terms.jacobian.row(i);
  const Matrix Y = mass.llt().solve(A.transpose());
  const Vector p = -(A * Y).ldlt().solve(A * v_minus);
  ImpactResult result;
  result.v_plus = v_minus + Y * p;
  result.impulse = Vector::Zero(system.num_constraints());
  result.hit = J;
  row = 0;
  for (int i : J) result.impulse(i) = p(row++);
  return result;
}

}  // namespace contact_flow
