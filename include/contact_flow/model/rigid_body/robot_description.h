// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/rigid_body/constraint_element.h"
#include "contact_flow/model/rigid_body/effort_element.h"
#include "contact_flow/model/rigid_body/robot_model.h"

namespace contact_flow {

/// A number of a robot that can be a parameter, by where it is kept.
struct NumberPlace {
  enum class Owner { kEffort, kConstraint, kRestitution, kFriction, kLink, kGravity };
  Owner owner;
  int index = 0;   ///< of the effort, the constraint or the link
  int number = 0;  ///< of the element; of a link: mass, x, y, z, ixx, ixy, ixz, iyy, iyz, izz
};

/// A parameter of the system: one number, or several that are the same.
struct ExposedNumber {
  Parameter parameter;
  Range range;
  std::vector<NumberPlace> places;
};

/// Linear feedback of the whole state, which every effort sees in place of the inputs:
///   u = u₀ − K_q (q ⊟ q_ref) − K_v (v − v_ref),      u₀ what is given as input.
/// q ⊟ q_ref is the difference on lines and on circles, whose turns count; of rotations sin θ n, θ
/// and n the angle and axis of q relative to q_ref in its own axes: ConfigurationSpace::Difference
/// to first order, and smooth where that is not.
struct StateFeedback {
  Matrix gain_q, gain_v;  ///< K_q, K_v [m×nv]; empty: no feedback
  Vector q, v;            ///< the reference [nq], [nv]

  bool empty() const { return gain_q.size() == 0; }
  /// q ⊟ q_ref [nv].
  void Error(const ConfigurationSpace& space, const VectorRef& position, Vector* error) const;
  /// Multiplies [·×nv] by ∂(q ⊟ q_ref)/∂η.
  void ByTangents(const ConfigurationSpace& space, const VectorRef& position,
                  Matrix* product) const;
};

/// Everything that makes a robot a mechanical system with contact.
struct RobotDescription {
  RobotModel model;
  double gravity = 9.81;  ///< downward along the world's z [m/s²]
  std::vector<std::unique_ptr<ConstraintElement>> constraints;  ///< unilateral
  std::vector<std::unique_ptr<ConstraintElement>> closures;     ///< rows of bilateral constraints
  std::vector<std::unique_ptr<EffortElement>> efforts;
  /// Inertia of each velocity number's rotor, as its joint feels it [nv], or empty [kg·m²], [kg]:
  /// M gets it on its diagonal.
  Vector armature;
  /// Share of the weight of what each joint carries, by the robot's own masses, that its actuator
  /// bears [nv], or empty: its joint gets that share of G(q).
  Vector weight_share;
  StateFeedback feedback;
  /// Constraints that are no contacts, but instants at which references have switches.
  std::vector<int> switches;
  std::vector<std::string> inputs;
  std::vector<ExposedNumber> parameters;
  NominalRun nominal;
};

/// Every number there is with the name it is found by: "gravity", "links/L/mass" (in the frame of
/// link L: centre of mass x, y, z and inertia about it ixx … izz), "E/stiffness" of effort E,
/// "C/offset", "C/restitution" and, with friction that is finite, "C/friction" of constraint C.
std::vector<ExposedNumber> ListNumbers(const RobotDescription& robot);
double GetNumber(const RobotDescription& robot, const NumberPlace& place);
void SetNumber(const NumberPlace& place, double value, RobotDescription* robot);
/// Throws std::invalid_argument where a place is there twice, in one parameter or in two: the last
/// value would count, and derivatives by the others be wrong.
void CheckPlaces(const std::vector<ExposedNumber>& parameters);

}  // namespace contact_flow
