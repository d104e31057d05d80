// SPDX-License-Identifier: BSD-3-Clause
#include "tangent_sizes.h"

#include <algorithm>
#include <cmath>

#include "frictional_reset.h"

namespace contact_flow {
namespace {

bool IsSize(double size) { return size > 0 && std::isfinite(size); }

}  // namespace

Vector TangentSizes(ContactDynamics* dynamics, const Vector& x, ContactMode mode) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions(), k = dynamics->num_variables();
  const Vector q = x.head(nq), v = x.tail(d);
  Matrix mass;
  Vector force;
  system.Dynamics(q, v, dynamics->u(), mode, &mass, &force);
  dynamics->Differentiate(x, mode);
  Vector sizes = Vector::Ones(2 * d + k), heavy = Vector::Ones(d);
  for (int i = 0; i < d; ++i) {
    const double root = std::sqrt(mass(i, i));
    if (IsSize(root)) heavy(i) = root;
  }
  const double speed = heavy.cwiseProduct(v).norm();
  double time = speed / heavy.cwiseProduct(dynamics->acceleration()).norm();
  if (!IsSize(time)) time = 1;
  sizes.head(d) = time * heavy.cwiseInverse();
  sizes.segment(d, d) = heavy.cwiseInverse();
  if (k == 0) return sizes;
  Vector effects = time * (heavy.asDiagonal() * dynamics->acceleration_jacobian().rightCols(k))
                              .colwise()
                              .norm()
                              .transpose();
  const auto add = [&](const Eigen::RowVectorXd& row) {
    const double own = row.head(2 * d).cwiseProduct(sizes.head(2 * d).transpose()).norm();
    if (IsSize(own)) effects = effects.cwiseMax(row.tail(k).cwiseAbs().transpose() / own);
  };
  const Matrix rates = RateJacobian(*dynamics, x);
  for (Eigen::Index row = 0; row < rates.rows(); ++row) add(rates.row(row));
  for (int j = 0; j < k; ++j) {
    if (IsSize(effects(j))) sizes(2 * d + j) = 1 / effects(j);
  }
  return sizes;
}

}  // namespace contact_flow
