// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/trajectory_optimization/problem.h"

namespace contact_flow {

struct Unknowns::Led {
  std::shared_ptr<const LinearInputs> system;
  TrajectoryProblem problem;  // in its states; the inputs are those that were given
};

}  // namespace contact_flow
