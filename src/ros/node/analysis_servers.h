// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <ros/ros.h>

#include <vector>

#include "action_status.h"
#include "contact_flow/ComputeCovariance.h"
#include "contact_flow/ComputeGradient.h"
#include "contact_flow/ComputePoincareMap.h"
#include "contact_flow/DecideControllability.h"
#include "contact_flow/DecideStability.h"
#include "contact_flow/FindPeriodicOrbitAction.h"
#include "contact_flow/FindStabilizingFeedback.h"
#include "contact_flow/MakePolicy.h"
#include "contact_flow/OptimizeOutcomeAction.h"
#include "contact_flow/OptimizeTrajectoryAction.h"
#include "contact_flow/SweepEnsembleAction.h"
#include "src/ros/recording/outlet.h"
#include "src/ros/service/work_pool.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The services and actions that analyse what derivatives decide: `poincare_map`,
/// `assess_stability`, `find_stabilizing_feedback`, `assess_controllability`,
/// `propagate_covariance`, `gradient`, `make_policy`; `find_periodic_orbit`, `optimize`,
/// `optimize_trajectory`, `sweep`. Handlers may run at once; an action serves one goal at a time, a
/// new one takes its place.
class AnalysisServers {
 public:
  /// All must outlive this. Actions have threads of their own; services are answered by
  /// those of `work_node`.
  AnalysisServers(ros::NodeHandle* node, ros::NodeHandle* work_node, const Setup& setup,
                  Outlet* outlet, WorkPool* pool);

 private:
  bool ReturnMap(ComputePoincareMap::Request& in, ComputePoincareMap::Response& out);
  bool Stability(DecideStability::Request& in, DecideStability::Response& out);
  bool Feedback(FindStabilizingFeedback::Request& in, FindStabilizingFeedback::Response& out);
  bool Controllability(DecideControllability::Request& in, DecideControllability::Response& out);
  bool Covariance(ComputeCovariance::Request& in, ComputeCovariance::Response& out);
  bool Gradient(ComputeGradient::Request& in, ComputeGradient::Response& out);
  bool FollowRun(MakePolicy::Request& in, MakePolicy::Response& out);
  void FindOrbit(const FindPeriodicOrbitGoalConstPtr& goal);
  void Optimize(const OptimizeOutcomeGoalConstPtr& goal);
  void ChooseTrajectory(const OptimizeTrajectoryGoalConstPtr& goal);
  void RunEnsemble(const SweepEnsembleGoalConstPtr& goal);

  const Setup& setup_;
  Outlet* outlet_;
  WorkPool* pool_;
  std::vector<ros::ServiceServer> servers_;
  // As the actions', to see who listens.
  ros::Publisher orbit_results_, optimize_results_, trajectory_results_, sweep_results_;
  actionlib::SimpleActionServer<FindPeriodicOrbitAction> find_orbit_;
  actionlib::SimpleActionServer<OptimizeOutcomeAction> optimize_;
  actionlib::SimpleActionServer<OptimizeTrajectoryAction> choose_trajectory_;
  actionlib::SimpleActionServer<SweepEnsembleAction> sweep_;
};

}  // namespace ros_interface
}  // namespace contact_flow
