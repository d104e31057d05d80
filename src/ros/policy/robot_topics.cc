// SPDX-License-Identifier: BSD-3-Clause
#include "robot_topics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/nearest_name.h"
#include "src/ros/message/gate.h"

namespace contact_flow {
namespace ros_interface {
namespace {

const std::vector<std::string> kPlanar = {"base_x", "base_z", "base_pitch"};
const std::vector<std::string> kFloating = {"base_x",  "base_y",  "base_z", "base_qw",
                                            "base_qx", "base_qy", "base_qz"};
/// Of an orientation's quaternion from size 1.
constexpr double kNormTolerance = 1e-3;

/// Whether `names` begin with `first`.
bool BeginWith(const std::vector<std::string>& names, const std::vector<std::string>& first) {
  return names.size() >= first.size() && std::equal(first.begin(), first.end(), names.begin());
}

Eigen::Vector3d ToEigen(const geometry_msgs::Vector3& m) { return {m.x, m.y, m.z}; }

}  // namespace

RobotTopics::RobotTopics(const PolicyNames& names, double threshold)
    : names_(names), threshold_(threshold) {
  if (BeginWith(names.coordinates, kPlanar)) {
    base_ = Base::kPlanar;
    base_q_ = base_v_ = kPlanar.size();
  } else if (BeginWith(names.coordinates, kFloating)) {
    base_ = Base::kFloating;
    base_q_ = kFloating.size();
    base_v_ = 6;
  }
  if (names.coordinates.size() - base_q_ != names.velocities.size() - base_v_) {
    throw std::invalid_argument(
        "coordinates of the policy have a rotation that is none of a base: "
        "no standard topic tells it");
  }
}

std::optional<RobotTopics::State> RobotTopics::Take(const sensor_msgs::JointState& joints) {
  CheckMessage(joints);
  std::optional<State> state;
  if (waiting_ && odometry_) state = Made(*waiting_);
  waiting_.reset();
  if (state) {
    waiting_ = joints;
    return state;
  }
  if (!has_base() || (odometry_ && odometry_->header.stamp == joints.header.stamp)) {
    return Made(joints);
  }
  waiting_ = joints;
  return {};
}

std::optional<RobotTopics::State> RobotTopics::Take(const nav_msgs::Odometry& odometry) {
  CheckMessage(odometry.pose.pose);
  CheckMessage(odometry.twist.twist);
  const geometry_msgs::Quaternion& m = odometry.pose.pose.orientation;
  const double norm = Eigen::Quaterniond(m.w, m.x, m.y, m.z).norm();
  if (!(std::abs(norm - 1) <= kNormTolerance)) {
    throw std::invalid_argument("the orientation of odom has norm " + std::to_string(norm) +
                                ", expected 1");
  }
  odometry_ = odometry;
  if (!waiting_ || waiting_->header.stamp != odometry.header.stamp) return {};
  const std::optional<State> state = Made(*waiting_);
  waiting_.reset();
  return state;
}

void RobotTopics::Take(int constraint, const geometry_msgs::WrenchStamped& wrench) {
  CheckMessage(wrench);
  const bool touches = ToEigen(wrench.wrench.force).norm() > threshold_;
  touching_ = touches ? touching_.With(constraint) : touching_.Without(constraint);
}

std::optional<RobotTopics::State> RobotTopics::Made(const sensor_msgs::JointState& joints) {
  State state;
  state.header = joints.header;
  const std::size_t nq = names_.coordinates.size();
  state.x.resize(static_cast<Eigen::Index>(nq + names_.velocities.size()));
  for (std::size_t k = base_q_; k < nq; ++k) {
    const std::string& name = names_.coordinates[k];
    const auto at = std::find(joints.name.begin(), joints.name.end(), name);
    const auto i = static_cast<std::size_t>(at - joints.name.begin());
    if (at == joints.name.end() || i >= joints.position.size() || i >= joints.velocity.size()) {
      throw std::invalid_argument("joint_states have no position and velocity of " +
                                  QuoteName(name));
    }
    state.x(static_cast<Eigen::Index>(k)) = joints.position[i];
    state.x(static_cast<Eigen::Index>(nq + base_v_ + k - base_q_)) = joints.velocity[i];
  }
  if (has_base()) PutBase(&state.x);
  state.activated = touching_ - told_;
  state.released = told_ - touching_;
  told_ = touching_;
  return state;
}

void RobotTopics::PutBase(Vector* x) const {
  const geometry_msgs::Point& at = odometry_->pose.pose.position;
  const geometry_msgs::Quaternion& m = odometry_->pose.pose.orientation;
  const Eigen::Quaterniond turn = Eigen::Quaterniond(m.w, m.x, m.y, m.z).normalized();
  const Eigen::Vector3d v = turn * ToEigen(odometry_->twist.twist.linear);
  const Eigen::Vector3d w = ToEigen(odometry_->twist.twist.angular);
  const auto nq = static_cast<Eigen::Index>(names_.coordinates.size());
  if (base_ == Base::kPlanar) {
    x->head<3>() << at.x, at.z, 2 * std::atan2(turn.y(), turn.w());
    x->segment<3>(nq) << v.x(), v.z(), w.y();
    return;
  }
  x->head<7>() << at.x, at.y, at.z, turn.w(), turn.x(), turn.y(), turn.z();
  x->segment<6>(nq) << v, w;
}

}  // namespace ros_interface
}  // namespace contact_flow
