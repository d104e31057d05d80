// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "contact_flow/derivative/variation.h"

namespace contact_flow {

/// A part of an arc with its propagator [2d+k × 2d+k].
struct ArcPart {
  double t_begin, t_end;  // [s]
  Matrix phi;
};

/// An arc in parts of equally many steps of its tangents: a slip that begins or ends in space has
/// as many steps in the last microsecond as in the whole time before, and what is wrong there is
/// gone, or of no weight, behind it.
class ArcParts {
 public:
  static constexpr std::size_t kMost = 8;

  /// A step of the arc, and the propagator from its beginning on, this step included.
  void Add(double t_begin, double t_end, const Matrix& step, const Matrix& phi);
  /// The parts, their propagators in the coordinates of the steps. There is nothing to add.
  std::vector<ArcPart> Take(double t_begin, double t_end, const Matrix& phi);

 private:
  /// Two and two become one.
  void Join();

  std::vector<ArcPart> parts_;  // the last one is open; the first has no propagator before it ends
  std::size_t steps_ = 0;       // of the part that is open
  std::size_t most_ = 8;        // of a part
};

/// What may be wrong with the propagator of an arc.
struct PropagationErrors {
  /// As its steps estimate it, and what they leave of Φ F = F, relative to its largest entries.
  double relative = 0;
  /// Where contacts slip in space, what each step leaves of Φ F = F is here instead, with a sign of
  /// its own, carried to the end of the arc: the change of Φ that would explain it [2d+k × 2d+k].
  Matrix law;
  std::vector<ArcPart> parts;  // there, else none
};

/// PropagateArc with its errors.
Matrix PropagateArc(ContactDynamics* dynamics, const Arc& arc, double tolerance,
                    VariationStatistics* statistics, PropagationErrors* errors);

}  // namespace contact_flow
