// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// Adds to Transition::rest_error that `contacts`, which would bounce for so long [s], are made rest
/// by a change of v [d]. While one of several bounces, others may leave, or slip otherwise: how
/// much of that change stays is not known.
inline void AddRestError(double bounces_last, ConstraintSet contacts, const Vector& change,
                         Transition* transition) {
  const Eigen::Index d = change.size();
  Vector& error = transition->rest_error;
  if (error.size() == 0) error = Vector::Zero(2 * d);
  error.head(d) += bounces_last / 2 * change;
  if (contacts.Size() > 1) error.tail(d) += change;
}

}  // namespace contact_flow
