// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/model/rigid_body/spatial.h"

namespace contact_flow {

/// The meshes of one load, by their paths: each file is read once, however often it is asked for.
class ContactMeshes {
 public:
  struct Mesh {
    std::vector<Vec3<double>> vertices;  ///< [m], each once
    std::string wrong;                   ///< why there are none, and what to do; else ""
  };

  /// Meshes are sought by FindMesh from `folder`.
  explicit ContactMeshes(std::string folder) : folder_(std::move(folder)) {}
  /// The mesh that a URDF calls `name`.
  const Mesh& Take(const std::string& name);

 private:
  std::string folder_;
  std::map<std::string, Mesh> meshes_;  // those that are not found by their names
};

}  // namespace contact_flow
