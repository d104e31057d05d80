// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/coupling_slope.h"

#include <Eigen/QR>
#include <cmath>

#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {
namespace {

constexpr double kStep = 1e-4;

double Coupling(const MechanicalSystem& system, const VectorRef& q, int i, int j) {
  Vector x = Vector::Zero(system.state_size());
  x.head(q.size()) = q;
  Matrix G;
  Vector unused;
  Delassus(system, x, Vector::Zero(system.num_inputs()), ContactMode({i, j}), &G, &unused);
  return G(0, 1) / std::sqrt(G(0, 0) * G(1, 1));
}

}  // namespace

double CouplingSlope(const MechanicalSystem& system, const VectorRef& q, int i, int j) {
  if (system.HasConstantMass() && system.HasAffineConstraints()) return 0;
  const int d = system.dof();
  Vector gradient(d);
  for (int k = 0; k < d; ++k) {
    const Vector step = kStep * Vector::Unit(d, k);
    const Vector ahead = system.space().Retract(q, step), behind = system.space().Retract(q, -step);
    gradient(k) = (Coupling(system, ahead, i, j) - Coupling(system, behind, i, j)) / (2 * kStep);
  }
  // What is left of it along {a_i = a_j = 0}: the part outside the span of the two normals.
  ConstraintTerms terms;
  system.Constraints(q, Vector::Zero(d), &terms);
  Matrix normals(d, 2);
  normals << terms.jacobian.row(i).transpose(), terms.jacobian.row(j).transpose();
  return (gradient - normals * normals.colPivHouseholderQr().solve(gradient)).norm();
}

}  // namespace contact_flow
