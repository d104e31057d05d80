// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/PoincareRequest.h"
#include "contact_flow/PoincareResult.h"
#include "contact_flow/ResultWarning.h"
#include "contact_flow/ReturnSection.h"
#include "contact_flow/analysis/poincare.h"
#include "contact_flow/piecewise_linear/section.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answer of `poincare_map`, a function of setup and request alone. Throws
/// std::invalid_argument, naming the field, for a request that is not in order.
PoincareResult Answer(const Setup& setup, const PoincareRequest& request);

/// One return, with what is assessed of its derivative.
struct AssessedReturn {
  PoincareReturn one;
  double distance = 0;   ///< |P(x) ⊟ x|_∞
  double off_orbit = 0;  ///< the same beside the sizes of the motion, but for neutral shifts
  bool reducible = false;
  ReducedMap reduced;  ///< without the neutral directions; its basis is one of tangents [2d×k]
  std::vector<ResultWarning> warnings;  ///< on what is not as it should be
};

AssessedReturn AssessReturn(const Setup& setup, const PoincareRequest& request);

/// What a request for a return asks.
struct ReturnQuestion {
  Vector x, u;
  Section section;
  PoincareOptions options;
  Matrix neutral;  ///< directions [2d×k]
};
ReturnQuestion ResolveReturn(const Setup& setup, const PoincareRequest& request);

/// The same return as a message.
PoincareResult ToMsg(const MechanicalSystem& system, const AssessedReturn& assessed);

/// From one return of a system from x, with neutral directions as columns [2d×k].
AssessedReturn Reduce(const MechanicalSystem& system, const VectorRef& x, PoincareReturn one,
                      const Matrix& neutral);

Section ResolveSection(const MechanicalSystem& system, const std::string& field,
                       const ReturnSection& section);
/// Columns [2d×2]: the translation of these coordinates together, and its rate; none without names.
Matrix ResolveTranslation(const MechanicalSystem& system, const std::vector<std::string>& names);

}  // namespace ros_interface
}  // namespace contact_flow
