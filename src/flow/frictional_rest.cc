// SPDX-License-Identifier: BSD-3-Clause
#include "frictional_rest.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/driven.h"
#include "slip_onset.h"
#include "src/dynamics/implied_contacts.h"

namespace contact_flow {
namespace {

/// How closely an inequality of a word has to hold, relative.
constexpr double kRestBorder = 1e-10;
/// A slip in space that begins with the rest has this many absolute tolerances.
constexpr double kRestOnset = 10;
/// Slip that is rounding, relative to the velocities at both sides of the last impact.
constexpr double kNoSlip = 1e-12;

Letter LetterOf(const Friction& friction, double slip) {
  if (friction.dimension != 1 || !(friction.coefficient > 0)) return Letter::kSlip;
  return slip > 0 ? Letter::kForward : Letter::kBackward;
}

}  // namespace

std::optional<FrictionalRest> RestOfBounces(ContactDynamics* dynamics, const Transition& last,
                                            ConstraintSet closed, double gap_tolerance) {
  const MechanicalSystem& system = dynamics->system();
  const int nq = system.num_positions(), d = system.dof(), n = system.num_constraints();
  Vector x = last.x_plus;
  const Vector v = x.tail(d);
  ConstraintTerms terms;
  system.Constraints(x.head(nq), v, &terms);
  FrictionalRest rest;
  rest.closed = closed;
  ConstraintSet near;
  for (int i = 0; i < n; ++i) {
    const bool beside = !rest.closed.Contains(i) && !system.compliant().Contains(i);
    if (beside && std::abs(terms.gap(i)) <= gap_tolerance) near.Insert(i);
  }
  if (!near.Empty()) rest.closed = rest.closed | ImpliedClosed(system, x, rest.closed, near);
  if ((rest.closed - last.mode_after).Empty()) {  // they do already
    rest.v_plus = v;
    rest.mode = last.mode_after;
    rest.energy_lost = 0;
    return rest;
  }

  const double still = kNoSlip * std::max(v.norm(), last.x_minus.tail(d).norm());
  const ConstraintSet sticking = last.mode_before.Sticking() | last.mode_after.Sticking();
  std::vector<Eigen::RowVectorXd> rows, forces;  // A, and along what they push
  for (int i : rest.closed) {
    const Friction& friction = system.friction()[i];
    rows.push_back(terms.jacobian.row(i));
    forces.push_back(rows.back());
    const auto tangents = terms.jacobian.middleRows(friction.row, friction.dimension);
    const Vector slip = tangents * v;
    const bool sticks = sticking.Contains(i) || !(slip.norm() > still);
    if (!sticks) forces.back() -= friction.coefficient / slip.norm() * slip.transpose() * tangents;
    for (int k = 0; sticks && k < friction.dimension; ++k) {
      rows.push_back(tangents.row(k));
      forces.push_back(rows.back());
    }
  }
  Matrix A(static_cast<Eigen::Index>(rows.size()), d), W = A;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    A.row(static_cast<Eigen::Index>(k)) = rows[k];
    W.row(static_cast<Eigen::Index>(k)) = forces[k];
  }
  const InverseInertia inertia(system, x.head(nq), v);
  const Matrix reach = inertia * W.transpose();
  const Vector p = (A * reach).completeOrthogonalDecomposition().solve(-A * v);
  rest.v_plus = v + reach * p;
  if (!rest.v_plus.allFinite()) return std::nullopt;
  rest.energy_lost = -0.5 * p.dot(W * (v + rest.v_plus));  // seen from the surfaces

  x.tail(d) = rest.v_plus;
  TouchingContacts contacts;
  for (int i : rest.closed) {
    const Friction& friction = system.friction()[i];
    const Vector slip = terms.jacobian.middleRows(friction.row, friction.dimension) * rest.v_plus;
    const bool none = slip.norm() <= std::max(still, kNoSlip * rest.v_plus.norm());
    if (friction.dimension > 0 && friction.coefficient > 0 && (sticking.Contains(i) || none)) {
      contacts.still.Insert(i);
    } else {
      contacts.slipping.Set(i, LetterOf(friction, slip.size() > 0 ? slip(0) : 0));
    }
  }
  try {
    WordConventions by;
    rest.mode = SelectWord(dynamics, x, contacts, kRestBorder, &by);
  } catch (const FrictionRefusal&) {
    return std::nullopt;
  }
  const ConstraintSet begins = BeginInSpace(system, contacts.still, rest.mode);
  if (begins.Empty()) return rest;
  try {
    auto onsets = OnsetDirections(dynamics, x, contacts, rest.mode, begins, kRestBorder);
    for (auto& [i, onset] : onsets) onset *= kRestOnset * last.absolute_tolerance;
    MakeRest(system, rest.mode, onsets, &x);
  } catch (const FrictionRefusal&) {
    return std::nullopt;
  }
  rest.v_plus = x.tail(d);
  return rest;
}

}  // namespace contact_flow
