// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/Wrench.h>

#include <string>
#include <vector>

#include "contact_flow/ContactOrder.h"
#include "contact_flow/ContactTrajectory.h"
#include "contact_flow/DerivativeOptions.h"
#include "contact_flow/DerivativePiece.h"
#include "contact_flow/DirectionComparison.h"
#include "contact_flow/ModeSequence.h"
#include "contact_flow/NameList.h"
#include "contact_flow/RowMajorMatrix.h"
#include "contact_flow/SimulationOptions.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/flow/trajectory.h"

/// Values of the core as messages. ROS puts messages into the package's namespace, which is the
/// core's: that is why no message bears the name of a class of the core. Headers are left empty.
namespace contact_flow {
namespace ros_interface {

/// Frame of all that is published, fixed in the world with z up (REP 105: continuous, never jumps).
inline constexpr char kWorldFrame[] = "odom";

using Names = std::vector<std::string>;

std::vector<double> ToMsg(const VectorRef& vector);
Vector FromMsg(const std::vector<double>& numbers);
RowMajorMatrix ToMsg(const MatrixRef& matrix);
SimulationOptions ToMsg(const SimulateOptions& options);
DerivativeOptions ToMsg(const BDerivativeOptions& options);
DerivativePiece ToMsg(const LinearPiece& piece);
RunMargins ToMsg(const Margins& margins);
geometry_msgs::Wrench ToMsg(const Eigen::Vector3d& force, const Eigen::Vector3d& torque);
ContactTransition ToMsg(const SystemDescription& description, const Transition& transition);

/// The run with both ends of every arc and about `count` samples in between.
ContactTrajectory ToMsg(const SystemDescription& description, const Trajectory& trajectory,
                        double duration, int count);
/// What friction adds: the rows' constraints, and forces at the samples.
void AddForces(const MechanicalSystem& system, const Trajectory& trajectory,
               ContactTrajectory* message);
/// Where efforts pass their limits, of a run with dense output.
void AddLimits(const MechanicalSystem& system, const Trajectory& trajectory,
               ContactTrajectory* message);
/// The constraint of each tangential row [r].
Names TangentialNames(const MechanicalSystem& system);
/// The entries of the tangential rows of a force or impulse, or none.
std::vector<double> Tangential(const SystemDescription& description, const Vector& force);
ModeSequence ToModeSequence(const ContactTrajectory& trajectory);
std::vector<ModeInterval> ToModeIntervals(const Names& constraints, const Trajectory& trajectory);
/// "{left_foot, right_foot}" for every mode.
Names ToLabels(const Names& constraints, const std::vector<ContactMode>& modes);
/// The word of every mode, as "s-o".
Names ToWords(const Names& constraints, const std::vector<ContactMode>& modes);
/// One letter a constraint.
std::string ToWord(const Names& constraints, ContactMode mode);
ContactOrder ToMsg(const SystemDescription& description, const OrderOutcome& outcome);
/// Without name, direction and prediction; tangents have `size` entries.
DirectionComparison ToMsg(const Names& constraints, const QuotientReport& report,
                          Eigen::Index size);

}  // namespace ros_interface
}  // namespace contact_flow
