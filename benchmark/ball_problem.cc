// SPDX-License-Identifier: BSD-3-Clause
#include "ball_problem.h"

#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace benchmark {

BallProblem::BallProblem(double input) : system(MakeModel("driven_ball")) {
  constexpr int kCount = 251;
  constexpr double kStep = 0.004;
  problem.x = Eigen::Vector2d(4, 0);
  for (int k = 0; k < kCount; ++k) {
    problem.inputs.grid.push_back(k * kStep);
    problem.inputs.values.push_back(Vector::Constant(1, input));
  }
  problem.duration = kCount * kStep;
  problem.effort = Vector::Constant(1, 5e-7 / kStep / kStep);
  problem.weight = Vector::Constant(2, 100);
  problem.target = Eigen::Vector2d(1, 0);
}

}  // namespace benchmark
}  // namespace contact_flow
