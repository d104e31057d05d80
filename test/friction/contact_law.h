// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow::test {

/// The farthest that a solution is from (F4), relative to b.
inline double Missed(const FrictionProblem& problem, const FrictionSolution& found) {
  const Vector y = problem.G * found.force + problem.b;
  double missed = 0;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const FrictionContact& contact = problem.contacts[i];
    const int row = problem.Row(i);
    const double gain = problem.G(row, row), force = found.force(row);
    const Vector pull = found.force.segment(row + 1, contact.dimension);
    const Vector slip = y.segment(row + 1, contact.dimension);
    const Vector still = Vector::Zero(contact.dimension);
    const Vector way = contact.slips     ? Vector(contact.direction.head(contact.dimension))
                       : slip.norm() > 0 ? Vector(slip.normalized())
                                         : still;
    const double against = gain * (pull + contact.coefficient * force * way).norm();
    missed = std::max({missed, -y(row), -gain * force, std::min(std::abs(y(row)), gain * force),
                       gain * (pull.norm() - contact.coefficient * force),
                       contact.slips ? against : std::min(slip.norm(), against)});
  }
  return missed / problem.b.cwiseAbs().maxCoeff();
}

}  // namespace contact_flow::test
