// SPDX-License-Identifier: BSD-3-Clause
#include "contact_meshes.h"

#include <array>
#include <set>
#include <stdexcept>

#include "contact_flow/io/mesh_file.h"

namespace contact_flow {
namespace {

/// What is wrong where FindMesh finds nothing, and where it looked.
std::string NotFound(const std::string& name, const std::string& folder) {
  const std::string wrong = "its mesh '" + name + "' is not found";
  for (const char* scheme : {"package://", "model://"}) {
    if (name.rfind(scheme, 0) != 0) continue;
    return wrong + ": set ROS_PACKAGE_PATH to the folder that holds the package";
  }
  if (name.find("://") != std::string::npos || name.rfind("/", 0) == 0) return wrong;
  return wrong + " in " + (folder.empty() ? "the working folder" : folder) +
         ": it is sought beside the URDF (or write package://PACKAGE/FILE, and set "
         "ROS_PACKAGE_PATH)";
}

/// Vertices without those that were before: triangles of a file share them.
std::vector<Vec3<double>> Distinct(const std::vector<Vec3<double>>& vertices) {
  std::set<std::array<double, 3>> seen;
  std::vector<Vec3<double>> distinct;
  for (const Vec3<double>& p : vertices) {
    if (seen.insert({p(0), p(1), p(2)}).second) distinct.push_back(p);
  }
  return distinct;
}

}  // namespace

const ContactMeshes::Mesh& ContactMeshes::Take(const std::string& name) {
  const std::string path = FindMesh(name, folder_);
  const auto [at, is_new] = meshes_.try_emplace(path.empty() ? name : path);
  Mesh* mesh = &at->second;
  if (!is_new) return *mesh;
  if (path.empty()) {
    mesh->wrong = NotFound(name, folder_);
    return *mesh;
  }
  try {
    mesh->vertices = Distinct(ReadMeshVertices(path));
  } catch (const std::invalid_argument& error) {
    mesh->wrong = error.what();
  }
  return *mesh;
}

}  // namespace contact_flow
