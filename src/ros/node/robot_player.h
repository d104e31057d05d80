// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/ContactTrajectory.h"
#include "contact_flow/ModelDescription.h"
#include "contact_flow/OutcomeDerivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "src/ros/display/robot_display.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The private parameters of robot_player.
struct PlayerParameters {
  std::string source = "contact_flow";  ///< ~source: the node whose results are shown
  double duration = 0;  ///< ~duration of the run that is asked for at the start [s]; 0: the robot's
  double speed = 0.2;   ///< ~speed: seconds of the run in a second
  double pause = 1;     ///< ~pause at the end before it is played again [s]
  double rate = 50;     ///< ~rate of publishing [Hz]
  std::vector<std::string> directions;  ///< ~directions of the ghosts, as b_derivative calls them
  double size = 0.2;                    ///< ~size of the perturbation along each direction
  DisplayOptions display;               ///< ~world_frame, ~base_frame, ~tf_prefix
};

/// Throws std::invalid_argument, naming the parameter, for one that is not in order.
PlayerParameters ReadPlayerParameters();

/// Plays the last run of a contact_flow_node with a robot, over and over: joint_states, tf and the
/// markers ~contacts, ~terrain and ~ghosts. Ghosts are outcomes of perturbed runs, x(T) ⊞ size ·
/// B(w), one for each direction w of the node's last derivative; where the order of impacts
/// decides, where each order leads.
class RobotPlayer {
 public:
  /// Throws std::invalid_argument when what is described is not a robot.
  RobotPlayer(const PlayerParameters& parameters, const ModelDescription& description);

 private:
  void TakeTrajectory(const ContactTrajectory::ConstPtr& trajectory);
  void TakeDerivative(const OutcomeDerivative::ConstPtr& derivative);
  void Play(const ros::TimerEvent& event);
  /// State, contact mode and input of the run at t [s].
  void Sample(double t, Vector* x, ContactMode* mode, Vector* u) const;

  const PlayerParameters parameters_;
  const Setup setup_;
  RobotDisplay display_;
  ros::NodeHandle node_, private_;
  tf2_ros::TransformBroadcaster transforms_;
  tf2_ros::StaticTransformBroadcaster static_transforms_;
  ros::Publisher joint_states_, contacts_, terrain_, ghosts_;
  ros::Subscriber trajectory_subscriber_, derivative_subscriber_;
  ros::Timer timer_;
  ContactTrajectory::ConstPtr trajectory_;
  std::unique_ptr<ContactDynamics> dynamics_;  // with the input of that run
  ros::Time begin_;                            // when it began to be played
};

/// Asks the node for a run and a derivative, and plays until it is told to stop. Returns the exit
/// code of the process: 1 with a message when something is not in order.
int RunRobotPlayer();

}  // namespace ros_interface
}  // namespace contact_flow
