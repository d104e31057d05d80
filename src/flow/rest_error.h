// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// Whether the forces of `contacts` do not vanish for so long [s], as far as their rates tell; not
/// where these have none, as beside a slip that is singular.
inline bool HoldFor(ContactDynamics* dynamics, const Vector& x, ContactMode mode,
                    ConstraintSet contacts, double seconds) {
  try {
    for (int i : contacts) {
      const double rate = dynamics->ForceRate(x, mode, i);
      if (!(dynamics->force()(i) + seconds * rate > 0)) return false;
    }
    return true;
  } catch (const FrictionRefusal&) {
    return false;
  } catch (const std::domain_error&) {
    return false;
  }
}

/// Adds to Transition::rest_error that `contacts`, which would bounce for so long [s], are made
/// rest by a change of v [d]. One whose force vanishes meanwhile may not come back: how much of
/// that change stays is not known.
inline void AddRestError(ContactDynamics* dynamics, ConstraintSet contacts, double bounces_last,
                         const Vector& change, Transition* transition) {
  const Eigen::Index d = change.size();
  Vector& error = transition->rest_error;
  if (error.size() == 0) error = Vector::Zero(2 * d);
  error.head(d) += bounces_last / 2 * change;
  const ContactMode rest = transition->mode_after;
  if (!HoldFor(dynamics, transition->x_plus, rest, contacts & rest, bounces_last)) {
    error.tail(d) += change;
  }
}

}  // namespace contact_flow
