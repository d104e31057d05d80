// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/laws.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {
namespace adversary {
namespace {

// A run resolves speeds to 1e-9 of their size, and energy is quadratic in them.
constexpr double kEnergy = 1e-8;
// One direction is computed twice by the same branches: rounding, carried by cancellations; more
// where a contact is met slowly, as the answer says of its error, up to a part of its size.
constexpr double kHomogeneous = 1e-7, kAtMost = 1e-5;
// The derivative's own tolerance is 1e-9 of the largest entry of each arc; the field at the end has
// the error of the state, which gusts multiply.
constexpr double kFlow = 2e-4;
constexpr double kErrors = 10;  // estimated ones

double LargestOf(const Vector& x) { return x.cwiseAbs().maxCoeff(); }

}  // namespace

std::string BrokenEnergyLaw(const MechanicalSystem& system, const Trajectory& run) {
  const int d = system.dof();
  for (const Transition& t : run.transitions) {
    if (t.activated.Empty()) continue;
    const Vector q = t.x_minus.head(d), before = t.x_minus.tail(d), after = t.x_plus.tail(d);
    const Vector restitution = system.restitution();
    bool alike = true;
    for (int i : t.activated) {
      alike = alike && restitution(i) == restitution(*t.activated.begin());
    }
    if (!alike) continue;
    Matrix mass;
    Vector force;
    system.Dynamics(q, before, run.arcs.front().u, t.mode_before, &mass, &force);
    const double old_energy = before.dot(mass * before) / 2, energy = after.dot(mass * after) / 2;
    if (energy <= old_energy * (1 + kEnergy)) continue;
    std::ostringstream text;
    text << "energy of an impact grows by " << energy / old_energy - 1 << " at " << t.t;
    return text.str();
  }
  return "";
}

std::string BrokenHomogeneity(const BDerivative& B, const Vector& w, const Units& units) {
  const Vector once = units.Back(B(w));
  const double size = std::max(1.0, LargestOf(once));
  const double stated = LargestOf(units.Back(B.Error(w)));
  const double rounding = kHomogeneous * size + std::min(stated, kAtMost * size);
  for (const double factor : {1e-3, 7.0, 1e5}) {
    const double off = LargestOf(units.Back(B(factor * w)) / factor - once);
    if (off <= rounding) continue;
    std::ostringstream text;
    text << "B(" << factor << " w) is not " << factor << " B(w): off by " << off << " of " << size;
    return text.str();
  }
  return "";
}

std::string BrokenFlowLaw(const MechanicalSystem& system, const Trajectory& run,
                          const BDerivative& B, const Units& units, double loose) {
  const Arc& first = run.arcs.front();
  if (run.arcs.back().u != first.u) return "";
  const Vector start = ContactDynamics(system, first.u).Field(first.x_begin, first.mode);
  Vector w = Vector::Zero(B.arcs.front().cols());
  w.head(start.size()) = start;
  if (B.start.Leaves(w) >= 0) return "";
  Vector got;
  try {
    got = units.time * units.Back(B(w));
  } catch (const std::domain_error&) {
    return "";  // refused along this one direction
  }
  const Vector expected = units.time * units.Back(B.time);
  const double size = std::max(
      {1.0, LargestOf(got), LargestOf(expected), units.time * LargestOf(units.Back(start))});
  const double off = LargestOf(got - expected);
  // Rough ground multiplies errors from bounce to bounce; the estimate knows by how much.
  const double known = units.time * LargestOf(units.Back(B.Error(w)));
  if (off <= loose * kFlow * size + kErrors * known) return "";
  std::ostringstream text;
  text << "B(F(x0)) is not F(x(T)): off by " << off << " of " << size;
  return text.str();
}

}  // namespace adversary
}  // namespace contact_flow
