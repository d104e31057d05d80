// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// A way [m] within which a contact cannot touch its surface, and how quickly the contact passes
/// it at most [m/s].
struct Clearance {
  double distance = -std::numeric_limits<double>::infinity();
  double speed = 0;
};

/// How a contact passes its surface in one state.
struct SurfacePassage {
  /// Widths of the surface in a second [1/s]. Within a width of its way the gap may vanish and open
  /// again by the shape of the surface alone. 0: the surface is as wide as the motion.
  double pace = 0;
  Clearance above;   ///< from all that the surface has below the contact
  Clearance beside;  ///< from all of it, the way round
};

/// What a MechanicalSystem offers besides whose surfaces may be narrow: walls, stairs, spheres. A
/// step of the motion may be much longer than they are wide, and its ends tell nothing of them. So
/// gaps are looked at several times in a width.
class NarrowSurfaces {
 public:
  virtual ~NarrowSurfaces() = default;

  /// Whether any surface is narrow.
  virtual bool HasNarrowSurfaces() const = 0;
  /// Of each constraint at (q, v) [n].
  virtual void Passages(const VectorRef& q, const VectorRef& v,
                        std::vector<SurfacePassage>* passages) const = 0;
};

}  // namespace contact_flow
