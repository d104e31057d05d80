// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/io/map_reader.h"
#include "contact_flow/model/rigid_body/robot_description.h"
#include "contacts.h"

namespace contact_flow {

/// Calls read(name, reader) for each entry of a map of maps.
template <class Read>
void ForEach(const YAML::Node& map, const std::string& name, Read&& read) {
  MapReader outer(map, name);
  for (const std::string& key : outer.Keys()) {
    MapReader reader(outer.Child(key), name + "/" + key);
    read(key, &reader);
    reader.Finish();
  }
}

/// The list of the key `inputs` of the robot's map, each once.
void ReadInputs(MapReader* reader, std::vector<std::string>* inputs);
/// The map of the key `parameters`: names of numbers by name of parameter. A number has one.
void ReadParameters(const YAML::Node& map, RobotDescription* robot);

/// Reads the kind of an element, which must be one of `kinds`.
std::string ReadKind(MapReader* reader, const std::vector<std::string>& kinds);
/// Numbers by name into `values`, in the order of `names`.
void ReadNamed(const YAML::Node& map, const std::string& name,
               const std::vector<std::string>& names, double* values);
/// Makes quaternions of a map of positions unit ones; throws where one is far from it.
void NormalizeQuaternions(const RobotModel& model, const std::string& name, const std::string& line,
                          Vector* q);

/// Whether an effort of this map follows a function of time: then the robot needs a clock.
bool FollowsTime(const YAML::Node& efforts);
/// Whether a surface that the robot may touch moves with time: then it has a clock, too.
bool GroundMoves(const YAML::Node& document, const std::string& folder);
/// A constraint against the ground, which moves as the key `motion` of its map says:
///   motion: {direction: [1, 0, 0], velocity: 0.5}                    # a conveyor [m/s]
///   motion: {direction: [0, 0, 1], amplitude: 0.01, frequency: 20, phase: 0}      # [m], [Hz]
///   motion: {direction: [0, 0, 1], times: [0, 0.1, 0.3], values: [0, 0.02, 0]}    # a spline
std::unique_ptr<ConstraintElement> ReadMotion(MapReader* reader, const RobotModel& model,
                                              std::unique_ptr<ConstraintElement> still);
/// Lets nothing change the rate of the clock, which is pushed where ground moves.
void DriveClock(RobotDescription* robot);
/// The map of the key `efforts`.
void ReadEfforts(const YAML::Node& map, RobotDescription* robot);
/// Constraints knot_1, knot_2, … at all instants at which references of efforts have switches.
void AddSwitches(RobotDescription* robot);
///   gravity_compensation: {joints: [shoulder, elbow], share: 1}    # or joints: all
void ReadWeightShare(const YAML::Node& map, RobotDescription* robot);
///   feedback:
///     reference: {positions: {hip: 0.3}, velocities: {}}   # otherwise the nominal state
///     gains:                                              # u = u0 − K (x − x_ref)
///       hip_torque: {positions: {hip: 40, base_pitch: 9}, velocities: {hip: 2}}
///       knee_torque: [0, 0, …]                        # or the row, in the order of velocities,
///                                                     # positions first
void ReadFeedback(const YAML::Node& map, RobotDescription* robot);

/// The value of a key `friction` of a map that is called `map`: a coefficient that is not negative,
/// or no_slip, which is infinite.
double ReadFriction(const std::string& map, MapReader* reader);

/// The bilateral constraints of the mimic joints, called J_mimic.
void AddMimics(RobotDescription* robot);

/// The map of the key `closures`: points that coincide, joints that follow one another.
void ReadClosures(const YAML::Node& map, RobotDescription* robot);

/// Puts mimic joints where the joints that they follow send them, but for those that the YAML says.
void Follow(const YAML::Node& positions, const YAML::Node& velocities, const RobotModel& model,
            Vector* q, Vector* v);

/// Adds a pad for each joint whose friction the key `joints` asks for: a coordinate J_pad [m] that
/// rests at zero (constraint::Brake).
void AddBrakePads(const YAML::Node& map, RobotModel* model);

/// What the key `joints` asks for: stops, dampers, friction and rotors of joints by the URDF.
struct JointChoices {
  YAML::Node constraints{YAML::NodeType::Map};
  YAML::Node efforts{YAML::NodeType::Map};
  std::vector<std::unique_ptr<ConstraintElement>> brakes;  ///< joints with friction
  std::vector<std::string> limited;                        ///< joints with stops
};

///   joints:
///     limits: all             # or a list: stops at the limits of the URDF, J_lower and J_upper
///     restitution: 0          # of the stops
///     damping: [knee]         # or all: by the URDF, J_damping
///     friction: [knee]        # or all: Coulomb's by the URDF, J_friction
///     armature: {knee: 0.01}  # inertia of the rotor times the gear ratio squared [kg m² or kg]
JointChoices ReadJoints(const YAML::Node& map, RobotDescription* robot);
/// Puts joints with stops that exclude zero into the middle of their range.
void CentreLimited(const std::vector<std::string>& limited, const RobotModel& model, Vector* q);

///   soles:
///     left_foot: {stiffness: 6000, damping: 15, mass: 0.05}
/// Each adds a link left_foot_sole, a point of that mass on springs along the axes of the link
/// (joints left_foot_sole_x, _y, _z), and hands it the link's collision geometry.
/// Returns the efforts.
YAML::Node AddSoles(const YAML::Node& map, RobotModel* model);
/// Throws for constraints of a link that has a sole: they are meant for what touches.
void CheckSoledLinks(const YAML::Node& soles, const YAML::Node& constraints);

/// These throw for what can be read and makes no sense: stairs none of whose steps rises; an
/// actuator whose input does nothing; soles that touch nothing.
void CheckStairs(const ElementParts& parts, const MapReader& reader);
void CheckGear(const ElementParts& parts, const MapReader& reader);
void CheckSoles(const YAML::Node& document, const RobotModel& model);

/// Contacts that the YAML asks for, and those of a robot that could fall and has neither
/// `constraints` nor `contacts`; nothing (count 0) otherwise. Meshes are sought from `folder`.
MadeContacts PlanContacts(const YAML::Node& document, const std::string& folder,
                          const RobotModel& model, const std::vector<std::string>& limited = {});

/// Constraints that do not come from the key `constraints`.
struct ConstraintCounts {
  int contacts = 0, stops = 0, brakes = 0, switches = 0;
};
/// Throws where the robot has more constraints, with friction and without, than a system may have;
/// says what counts, where it is from (`document`) and what to do. Warns where contacts without
/// friction would need more room than there is.
void CheckRoom(const ConstraintCounts& counts, const YAML::Node& document, RobotDescription* robot);

}  // namespace contact_flow
