// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>

#include "contact_flow/model/rigid_body/kinematics.h"
#include "contact_flow/ros/robot_display.h"

namespace contact_flow {
namespace ros_interface {

std::vector<geometry_msgs::Wrench> RobotDisplay::ContactWrenches(const VectorRef& x,
                                                                 const VectorRef& force) const {
  const VectorRef q = x.head(system_.num_positions());
  TreeState<double> state(system_.robot().model.tree);
  UpdatePositions(system_.robot().model.tree, q.data(), &state);
  std::vector<geometry_msgs::Wrench> wrenches(static_cast<std::size_t>(force.size()));
  for (int i = 0; i < force.size(); ++i) {
    Vec3<double> point, per_force;
    ContactPoint(i, state, q, &point, &per_force);
    const Vec3<double> f = force(i) * per_force, torque = point.cross(f);
    wrenches[static_cast<std::size_t>(i)] = ToMsg(f, torque);
  }
  return wrenches;
}

}  // namespace ros_interface
}  // namespace contact_flow
