// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "contact_flow/flow/dense_step.h"

namespace contact_flow {

/// How quick the motion along an arc is, as the steps tell that the run needed for its state: where
/// the motion is quick its Jacobian is, too, and must not be stepped over.
class MotionPace {
 public:
  explicit MotionPace(const DenseArc& dense);

  /// The longest step of the tangents from t with that many samples of the Jacobian: one for each
  /// step of the state, as short as the shortest that it meets. [s]
  double Reach(double t, int samples) const;
  /// Length of the state's own step at t [s].
  double StateStep(double t) const;

 private:
  struct Step {
    double begin;
    double whole;   ///< its length [s]
    double length;  ///< as short as the motion made it; infinite where something else did
  };
  std::size_t StepAt(double t) const;

  std::vector<Step> steps_;
  double span_ = 0;  // of all
};

}  // namespace contact_flow
