// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/analysis/return_symmetry.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Where a return map is taken: a surface {s(x) = 0} with a direction of crossing, or an instant.
struct Section {
  /// What is crossed.
  enum class Kind {
    kCoordinate = 0,  ///< s = q_i − value
    kVelocity = 1,    ///< s = v_i − value; an apex is a vertical velocity that falls through zero
    kEvent = 2,  ///< the right limit of the activation of a constraint, or of a compliant one's
                 ///< gap that falls through zero; alone, not in a cluster
    kTime = 3,   ///< after `value` seconds: the phase of a clock
  };
  Kind kind = Kind::kTime;       ///< what is crossed
  int index = 0;                 ///< of the position number, velocity or constraint
  double value = 0;              ///< [m], [rad], [m/s], [rad/s] or [s]
  int sign = 0;                  ///< +1: s rises through zero, −1: it falls, 0: either
  ReturnSymmetry symmetry = {};  ///< g, with which a return is the start over again

  /// By name; throw std::invalid_argument, with the nearest, for an unknown one.
  static Section Coordinate(const MechanicalSystem& system, const std::string& name, double value,
                            int sign);
  /// Where the velocity of a coordinate falls through zero.
  static Section Apex(const MechanicalSystem& system, const std::string& coordinate);
  /// Just behind the impact of a constraint.
  static Section Event(const MechanicalSystem& system, const std::string& constraint);
  /// After some seconds, whatever the state.
  static Section After(double seconds);

  /// s(x) and ds [2d]; for an event the gap, for an instant zero.
  double Height(const MechanicalSystem& system, const VectorRef& x, Vector* gradient) const;
};

/// Throws std::invalid_argument for a section the system has not.
void Validate(const MechanicalSystem& system, const Section& section);

}  // namespace contact_flow
