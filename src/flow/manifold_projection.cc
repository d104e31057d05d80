// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/manifold_projection.h"

#include "contact_flow/dynamics/inverse_inertia.h"

namespace contact_flow {
namespace {

constexpr int kMaxNewton = 30;
constexpr double kClosed = 1e-14;  // [m] a closure to rounding

}  // namespace

bool HasStateManifold(const MechanicalSystem& system) {
  return system.num_bilateral() > 0 || !system.space().IsFlat();
}

bool ProjectState(const MechanicalSystem& system, Vector* x) {
  const int d = system.dof(), nq = system.num_positions(), l = system.num_bilateral();
  system.space().Normalize(x->data());
  if (l == 0) return x->allFinite();
  double last = 0;
  for (int step = 0; step < kMaxNewton; ++step) {
    const InverseInertia inertia(system, x->head(nq), x->tail(d));
    const Vector b = inertia.terms().gap.tail(l);
    const double error = b.cwiseAbs().maxCoeff();
    if (!(error < 1e3)) return false;
    const bool stalled = step > 1 && error >= 0.5 * last && error < 1e-11;
    if (error <= kClosed || stalled) {
      x->tail(d) += inertia.Correction(inertia.terms().jacobian.bottomRows(l) * x->tail(d));
      return x->allFinite();
    }
    x->head(nq) = system.space().Retract(x->head(nq), inertia.Correction(b));
    last = error;
  }
  return false;
}

}  // namespace contact_flow
