// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

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
    anchor_ = std::max(stamp, After(last_, kStep));
  }
  /// Beyond the last time that ROS can tell, in 2106, it is that.
  ros::Time At(double t) const {
    if (!(t > t_)) return anchor_ + ros::Duration(std::max(t - t_, -anchor_.toSec()));
    return After(anchor_, t - t_);
  }
  /// The stamp of what is published at t.
  ros::Time Take(double t) {
    if (!(At(t) > last_)) Anchor(t, After(last_, kStep));
    last_ = At(t);
    return last_;
  }
  const ros::Time& last() const { return last_; }
  /// The simulated time of a stamp [s].
  double TimeOf(const ros::Time& stamp) const {
    // A ros::Duration holds 68 years only, and throws.
    const auto since = static_cast<std::int64_t>(stamp.toNSec() - anchor_.toNSec());
    const double seconds = 1e-9 * static_cast<double>(since);
    return t_ + (std::abs(seconds) < kLongest ? (stamp - anchor_).toSec() : seconds);
  }

 private:
  static constexpr double kStep = 1e-6;
  static constexpr double kLongest = 2e9;  // [s] of a ros::Duration

  static ros::Time After(const ros::Time& stamp, double seconds) {
    const double left = 1e-9 * static_cast<double>(ros::TIME_MAX.toNSec() - stamp.toNSec());
    return seconds < std::min(left, kLongest) ? stamp + ros::Duration(seconds) : ros::TIME_MAX;
  }

  double t_ = 0;
  ros::Time anchor_;
  ros::Time last_{1, 0};
};

}  // namespace ros_interface
}  // namespace contact_flow
