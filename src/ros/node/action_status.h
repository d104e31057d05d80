// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <actionlib_msgs/GoalStatusArray.h>
#include <ros/ros.h>

#include <iterator>

#include "contact_flow/FindPeriodicOrbitAction.h"
#include "contact_flow/OptimizeOutcomeAction.h"
#include "contact_flow/OptimizeTrajectoryAction.h"
#include "contact_flow/SweepEnsembleAction.h"

/// What actionlib tells of goals, several times a second, without believing the stamps that clients
/// send: it adds seconds to that of a cancel, which at the end of time ended the process, and a
/// cancel of tomorrow ended all goals until then. No stamp of theirs is later than now.
namespace contact_flow {
namespace ros_interface {

template <class Goals>
actionlib_msgs::GoalStatusArray TellGoals(const ros::Duration& kept, Goals* goals,
                                          ros::Time* last_cancel) {
  const ros::Time now = ros::Time::now();
  if (*last_cancel > now) *last_cancel = now;
  actionlib_msgs::GoalStatusArray told;
  told.header.stamp = now;
  for (auto goal = goals->begin(); goal != goals->end();) {
    told.status_list.push_back(goal->status_);
    ros::Time& gone = goal->handle_destruction_time_;
    if (gone > now) gone = now;
    const bool over = !gone.isZero() && now.toSec() - gone.toSec() > kept.toSec();
    goal = over ? goals->erase(goal) : std::next(goal);
  }
  return told;
}

}  // namespace ros_interface
}  // namespace contact_flow

namespace actionlib {

template <>
inline void ActionServer<contact_flow::FindPeriodicOrbitAction>::publishStatus() {
  const boost::recursive_mutex::scoped_lock lock(lock_);
  status_pub_.publish(
      contact_flow::ros_interface::TellGoals(status_list_timeout_, &status_list_, &last_cancel_));
}
template <>
inline void ActionServer<contact_flow::OptimizeOutcomeAction>::publishStatus() {
  const boost::recursive_mutex::scoped_lock lock(lock_);
  status_pub_.publish(
      contact_flow::ros_interface::TellGoals(status_list_timeout_, &status_list_, &last_cancel_));
}
template <>
inline void ActionServer<contact_flow::OptimizeTrajectoryAction>::publishStatus() {
  const boost::recursive_mutex::scoped_lock lock(lock_);
  status_pub_.publish(
      contact_flow::ros_interface::TellGoals(status_list_timeout_, &status_list_, &last_cancel_));
}
template <>
inline void ActionServer<contact_flow::SweepEnsembleAction>::publishStatus() {
  const boost::recursive_mutex::scoped_lock lock(lock_);
  status_pub_.publish(
      contact_flow::ros_interface::TellGoals(status_list_timeout_, &status_list_, &last_cancel_));
}

}  // namespace actionlib
