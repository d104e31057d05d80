// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "contact_flow/model/rigid_body/robot_model.h"
#include "contact_flow/model/rigid_body/urdf_loader.h"

namespace contact_flow {

/// What is found in a file, to be told together.
struct Findings {
  std::vector<std::string> errors, warnings;
  /// Throws std::invalid_argument with all errors, if there are any.
  void ThrowIfAny() const;
};

/// A URDF before urdfdom.
struct UrdfSource {
  std::string text;  ///< with spaces in place of what is not read; lines are kept
  std::map<std::string, std::vector<RobotModel::Shape>> shapes;  ///< by the name of the link
  std::vector<std::string> unknown_names;                        ///< of FindUnknownNames
};

/// Sorts a URDF that CheckUrdfText has passed: numbers that are none are errors with their line;
/// visual geometry, transmissions, simulators' tags and all else that is not read is taken out,
/// collision geometry is read. What RepairUrdf does, and names that FindUnknownNames finds, are
/// errors where faults are strict.
UrdfSource SortUrdf(const std::string& text, UrdfFaults faults, Findings* findings);

}  // namespace contact_flow
