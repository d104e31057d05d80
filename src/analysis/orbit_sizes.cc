// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/orbit_sizes.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

constexpr double kShare = 1e-2;  // of the speed by the energy of all, that a velocity has at least
constexpr double kNoInertia = 1e-150;

}  // namespace

double OrbitSizes::Of(const VectorRef& gradient) const {
  const double size = gradient.cwiseAbs().dot(tangent);
  return size > 0 ? size : 1;
}

double OrbitSizes::Compare(const VectorRef& difference) const {
  return difference.size() > 0 ? difference.cwiseQuotient(Larger()).cwiseAbs().maxCoeff() : 0;
}

OrbitSizes SizesOf(const MechanicalSystem& system, const Trajectory& run) {
  const int d = system.dof(), nq = system.num_positions();
  OrbitSizes sizes;
  sizes.tangent = sizes.place = Vector::Ones(2 * d);
  if (run.arcs.empty()) return sizes;
  const double duration = run.arcs.back().t_end - run.arcs.front().t_begin;
  if (duration > 0) sizes.time = duration;
  Vector speed = Vector::Zero(d), share = Vector::Zero(d), place = Vector::Zero(d);
  Matrix mass;
  Vector force;
  for (const Arc& arc : run.arcs) {
    for (const Vector* x : {&arc.x_begin, &arc.x_end}) {
      const auto v = x->tail(d);
      system.Dynamics(x->head(nq), v, arc.u, arc.mode, &mass, &force);
      const double all = kShare * KineticSpeed(mass, v);
      speed = speed.cwiseMax(v.cwiseAbs());
      const Vector unit = mass.diagonal().cwiseAbs().cwiseMax(kNoInertia).cwiseSqrt();
      share = share.cwiseMax(all * unit.cwiseInverse());
      if (nq != d) continue;
      const Vector q = x->head(d).cwiseAbs();
      const double reach = kShare * Moved(mass, q).cwiseProduct(unit).maxCoeff();
      place = place.cwiseMax(q).cwiseMax(reach * unit.cwiseInverse());
    }
  }
  for (int i = 0; i < d; ++i) {
    const double size = std::max(speed(i), share(i));
    if (size > 0 && std::isfinite(size)) {
      sizes.tangent(d + i) = size;
      sizes.tangent(i) = size * sizes.time;
    }
    if (place(i) > 0) sizes.place(i) = place(i);
    sizes.place(d + i) = sizes.place(i) / sizes.time;
  }
  return sizes;
}

double OffOrbit(const MechanicalSystem& system, const VectorRef& x, const PoincareReturn& one,
                const MatrixRef& neutral) {
  const int d = system.dof();
  const OrbitSizes sizes = SizesOf(system, one.trajectory);
  const Vector apart = system.Separation(one.x, x), size = sizes.Larger();
  std::vector<int> shifts;
  for (int k = 0; k < neutral.cols(); ++k) {
    if (neutral.col(k).tail(d).isZero(0)) shifts.push_back(k);
  }
  Matrix along(2 * d, static_cast<Eigen::Index>(shifts.size()));
  for (std::size_t k = 0; k < shifts.size(); ++k) {
    along.col(static_cast<Eigen::Index>(k)) = neutral.col(shifts[k]).cwiseQuotient(size);
  }
  if (along.cols() == 0) return sizes.Compare(apart);
  const Vector shift = along.completeOrthogonalDecomposition().solve(apart.cwiseQuotient(size));
  return sizes.Compare(apart - size.cwiseProduct(along * shift));
}

}  // namespace contact_flow
