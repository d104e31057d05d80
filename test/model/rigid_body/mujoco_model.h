// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "contact_flow/model/rigid_body/rigid_body_tree.h"

namespace contact_flow {

/// A RigidBodyTree as a MuJoCo model without contacts. MuJoCo wants mass in every body: ours
/// without join the body that they carry, of which they are further joints.
class MujocoModel {
 public:
  /// `extra` is XML inside the <mujoco> element, `inside` what a body contains besides.
  explicit MujocoModel(const RigidBodyTree& tree, const std::string& extra = "",
                       const std::vector<std::string>& inside = {});
  ~MujocoModel();
  MujocoModel(const MujocoModel&) = delete;
  MujocoModel& operator=(const MujocoModel&) = delete;

  /// Copies a state, ours, into data.
  void SetState(const Vector& q, const Vector& v);
  /// Our velocity number of each of theirs.
  const std::vector<int>& ours() const { return ours_; }
  /// Their body of one of ours, and where our frame is in it at rest.
  int body(int i) const { return body_[i]; }
  const Pose& frame(int i) const { return frame_[i]; }
  bool merged(int i) const { return merged_[i]; }

  mjModel* model = nullptr;
  mjData* data = nullptr;

 private:
  std::string Body(int i, const std::vector<std::string>& inside);

  const RigidBodyTree& tree_;
  std::vector<std::vector<int>> children_;
  std::vector<int> body_, ours_;
  std::vector<Pose> frame_;
  std::vector<bool> merged_;
};

}  // namespace contact_flow
