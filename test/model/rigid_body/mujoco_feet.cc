// SPDX-License-Identifier: BSD-3-Clause
#include "test/model/rigid_body/mujoco_feet.h"

#include <cstdio>
#include <string>
#include <vector>

namespace contact_flow {

std::unique_ptr<MujocoModel> OnFeetInMujoco(const RobotSystem& system, int condim, double radius) {
  const RobotModel& model = system.robot().model;
  std::vector<std::string> inside(model.tree.num_bodies() + 1);
  char geom[240];
  std::snprintf(geom, sizeof(geom),
                "<geom type=\"plane\" size=\"5 5 1\" condim=\"%d\" friction=\"0 0 0\"/>", condim);
  inside.back() = geom;
  for (std::size_t i = 0; i < system.robot().constraints.size(); ++i) {
    const AttachedPoint& foot = system.robot().constraints[i]->parts.points[0];
    const double friction = condim > 1 ? system.friction()[i].coefficient : 0;
    std::snprintf(geom, sizeof(geom),
                  "<geom type=\"sphere\" size=\"%g\" pos=\"%.17g %.17g %.17g\" condim=\"%d\" "
                  "friction=\"%.17g 0 0\"/>",
                  radius, foot.local(0), foot.local(1), foot.local(2), condim, friction);
    inside[foot.body] += geom;
  }
  return std::make_unique<MujocoModel>(model.tree, "<option cone=\"elliptic\"/>", inside);
}

}  // namespace contact_flow
