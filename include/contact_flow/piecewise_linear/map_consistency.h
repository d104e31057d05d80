// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What keeps pieces from being one continuous map.
enum class MapDefect {
  kNone = 0,
  kGap = 1,        ///< a direction that no cone holds
  kOverlap = 2,    ///< two cones share interior, and their matrices differ there
  kJump = 3,       ///< two matrices differ on the common face of their cones
  kUndecided = 4,  ///< the budget did not suffice, or there are no linear programs (Clp)
};

/// "gap", …
const char* MapDefectName(MapDefect defect);

/// Settings of the check.
struct MapConsistencyOptions {
  /// Half-spaces whose unit normals differ by less are one; gaps and overlaps with no larger ball
  /// within the unit box are none; jumps of (A w)_r below this part of
  /// max_k ‖(A_k)_r‖₁ ‖w‖_∞ are none. It says how far the pieces may be from a continuous map.
  double tolerance = 1e-7;
  /// Jumps below this part of the largest of all rows are rounding errors, of a row that vanishes
  /// but for them.
  double rounding = 1e-12;
  long max_linear_programs = 100000;  ///< budget
  /// The map is a derivative of ours, whose pieces are continuous by construction: what the check
  /// leaves undecided is believed. A defect is none the less.
  bool believe_undecided = false;
  /// The caller has made the check: it is not made again.
  bool checked = false;
  /// Asked now and then; returning true ends the check, undecided.
  std::function<bool()> cancelled;
};

/// What was found.
struct MapConsistency {
  MapDefect defect = MapDefect::kNone;  ///< what is wrong
  /// The pieces concerned: of a gap the one whose face has nothing behind it; −1: none.
  int first = -1;
  int second = -1;  ///< the one that overlaps or does not agree
  Vector w;         ///< where it is seen, |w|_∞ = 1
  double size = 0;  ///< of a gap: the distance of w to all cones; else the relative jump at w
  long linear_programs = 0;  ///< solved
  std::string message;       ///< with the pieces, w and the size; empty when all is well
  /// No defect; or undecided, which was to be believed.
  bool usable = true;

  /// Whether no defect was found.
  bool ok() const { return defect == MapDefect::kNone; }
};

/// Do the pieces w ↦ A_i w on C_i = {w : cone_i·w ≥ 0} make one continuous map: do the cones cover
/// the space, without overlap (unless the matrices agree there), and do the matrices agree on
/// common faces? Decided by linear programs, facet by facet: cones with interior cover the space
/// iff every facet of every one is covered, from its other side, by others; and the map is
/// continuous iff it is so across facets. Of cones without interior the values are compared where
/// they meet others. Throws std::invalid_argument for numbers that are not finite.
MapConsistency CheckConsistency(const PiecewiseLinearMap& map,
                                const MapConsistencyOptions& options = {});

}  // namespace contact_flow
