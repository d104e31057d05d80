// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>

#include "contact_flow/model/rigid_body/contact_place.h"
#include "contact_flow/model/rigid_body/kinematics.h"
#include "robot_display.h"

namespace contact_flow {
namespace ros_interface {

std::vector<geometry_msgs::Wrench> RobotDisplay::ContactWrenches(const VectorRef& x,
                                                                 const VectorRef& force) const {
  TreeState<double> state(system_.robot().model.tree);
  UpdatePositions(system_.robot().model.tree, x.data(), &state);
  std::vector<geometry_msgs::Wrench> wrenches(static_cast<std::size_t>(system_.num_constraints()));
  for (int i = 0; i < system_.num_constraints(); ++i) {
    Vec3<double> point, f;
    PlaceContact(system_, i, state, force, &point, &f);
    const Vec3<double> torque = point.cross(f);
    wrenches[static_cast<std::size_t>(i)] = ToMsg(f, torque);
  }
  return wrenches;
}

}  // namespace ros_interface
}  // namespace contact_flow
