// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/urdf_loader.h"
#include "urdf_source.h"

namespace contact_flow {

/// By how much the largest principal moment of `central` exceeds the sum of the others, as a share
/// of the sum of all three; 0 for an inertia that a body can have.
double InertiaDefect(const Mat3<double>& central);

/// The nearest inertia that a body can have: with S = ½ tr(I) 1 − I, the second moments of its
/// mass, negative eigenvalues of S become zero.
Mat3<double> NearestInertia(const Mat3<double>& central);

/// Judges every body of the robot that moves: repairs its links, or complains of them.
void JudgeInertias(UrdfFaults faults, RobotModel* robot, Findings* findings);

}  // namespace contact_flow
