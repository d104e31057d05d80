// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/model/rigid_body/spatial.h"

namespace contact_flow {

/// The path of a mesh that a URDF names: package://P/F is sought below each folder of
/// ROS_PACKAGE_PATH and in the folders around the URDF's (`folder`, ending with a slash; may be
/// empty), and in such a folder that is called P, or is by its package.xml; a relative path beside
/// the URDF. "" where there is no such file.
std::string FindMesh(const std::string& name, const std::string& folder);

/// The vertices of a mesh [m]: STL (binary or text) and OBJ; others, as COLLADA, where the package
/// is built with assimp. Throws std::invalid_argument that names the file.
std::vector<Vec3<double>> ReadMeshVertices(const std::string& path);

}  // namespace contact_flow
