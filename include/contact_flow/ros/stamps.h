// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <algorithm>

namespace contact_flow {
namespace ros_interface {

/// Stamps of simulated times: stamp = anchor + (t − t₀). Every stamp that is taken is later than
/// all before, also where t begins anew, so that no listener to tf sees time go back; and none is
/// 0, which is no time to ROS.
class Stamps {
 public:
  /// t [s] is stamped `stamp`, or with the next one that may be.
  void Anchor(double t, const ros::Time& stamp) {
    t_ = t;
    anchor_ = std::max(stamp, last_ + kStep());
  }
  ros::Time At(double t) const { return anchor_ + ros::Duration(t - t_); }
  /// The stamp of what is published at t.
  ros::Time Take(double t) {
    if (!(At(t) > last_)) Anchor(t, last_ + kStep());
    last_ = At(t);
    return last_;
  }
  const ros::Time& last() const { return last_; }
  /// The simulated time of a stamp [s].
  double TimeOf(const ros::Time& stamp) const { return t_ + (stamp - anchor_).toSec(); }

 private:
  static ros::Duration kStep() { return ros::Duration(0, 1000); }

  double t_ = 0;
  ros::Time anchor_;
  ros::Time last_{1, 0};
};

}  // namespace ros_interface
}  // namespace contact_flow
