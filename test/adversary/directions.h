// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "test/adversary/draw.h"
#include "test/adversary/generator.h"

namespace contact_flow {
namespace adversary {

/// Draws directions w = (δq, δv, δu, δp) of a case.
class Directions {
 public:
  explicit Directions(const Case& c) : c_(c), draw_(c.seed ^ 0x5bd1e995u) {}

  int Size() const { return 2 * c_.system->dof() + c_.system->num_inputs() + 2; }
  /// The k-th, of length 1, which the contacts `kept` admit; some are ± of another, some an axis,
  /// some have inputs and parameters. 0 where contacts hold all coordinates.
  Vector Next(int k, ConstraintSet kept);

 private:
  const Case& c_;
  Draw draw_;
  Vector previous_;
};

/// Turns w to a direction that keeps these contacts to first order and does not push others that
/// touch at the start.
void Admit(const Case& c, ConstraintSet kept, Vector* w);

}  // namespace adversary
}  // namespace contact_flow
