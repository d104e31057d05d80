// SPDX-License-Identifier: BSD-3-Clause
#include "simulator_services.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "contact_flow/SimulateTrajectory.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/service/handler.h"
#include "src/ros/service/stopping.h"
#include "src/session/prediction.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kStatusPeriod = 0.4;  // [s]; the bag is behind by less than a second

/// For services without an answer: a refusal is a failed call. roscpp hands what is thrown here on
/// to the client as the reason, which `false` would not.
template <class Body>
bool Simply(const char* service, const Body& body) {
  try {
    body();
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string(service) + ": " + error.what());
  }
  return true;
}

/// A setting that is no number stays as it was.
void Keep(const char* name, double* asked, double* kept) {
  try {
    CheckNumber(name, *asked);
    *kept = *asked;
  } catch (const std::invalid_argument& error) {
    ROS_WARN("simulator: %s; it stays %g", error.what(), *kept);
    *asked = *kept;
  }
}

}  // namespace

SimulatorServices::SimulatorServices(Simulator* simulator, const SimulatorParameters& parameters,
                                     ros::NodeHandle* node, ros::NodeHandle* prompt_node,
                                     ros::NodeHandle* work_node, WorkPool* pool)
    : simulator_(simulator), pool_(pool) {
  using S = SimulatorServices;
  servers_ = {prompt_node->advertiseService("pause_physics", &S::Pause, this),
              prompt_node->advertiseService("unpause_physics", &S::Unpause, this),
              prompt_node->advertiseService("reset_simulation", &S::ResetSimulation, this),
              prompt_node->advertiseService("reset_world", &S::ResetWorld, this),
              prompt_node->advertiseService("step", &S::Step, this),
              prompt_node->advertiseService("set_state", &S::SetState, this),
              prompt_node->advertiseService("get_state", &S::GetState, this),
              prompt_node->advertiseService("set_input", &S::SetInputs, this),
              prompt_node->advertiseService("apply_impulse", &S::Push, this),
              prompt_node->advertiseService("set_parameters", &S::SetParameters, this),
              prompt_node->advertiseService("mark", &S::Mark, this),
              work_node->advertiseService("predict", &S::PredictFrom, this)};
  input_ = node->subscribe<InputCommand>(
      "input", 1000,
      [this](const InputCommand::ConstPtr& message) { simulator_->TakeInput(*message); },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  const ros::TransportHints quick = ros::TransportHints().tcpNoDelay();
  commands_ = {node->subscribe<sensor_msgs::JointState>(
                   "joint_commands", 1000,
                   [this](const sensor_msgs::JointState::ConstPtr& message) {
                     simulator_->TakeJoints(*message);
                   },
                   ros::VoidConstPtr(), quick),
               node->subscribe<std_msgs::Float64MultiArray>(
                   "commands", 1000,
                   [this](const std_msgs::Float64MultiArray::ConstPtr& message) {
                     simulator_->TakeNumbers(*message);
                   },
                   ros::VoidConstPtr(), quick),
               node->subscribe<trajectory_msgs::JointTrajectory>(
                   "joint_trajectory", 10,
                   [this](const trajectory_msgs::JointTrajectory::ConstPtr& message) {
                     simulator_->TakeTrajectory(*message);
                   },
                   ros::VoidConstPtr(), quick)};
  status_timer_ =
      node->createWallTimer(ros::WallDuration(kStatusPeriod),
                            [this](const ros::WallTimerEvent&) { simulator_->PublishStatus(); });
  OfferSettings(parameters, node);
}

void SimulatorServices::OfferSettings(const SimulatorParameters& parameters,
                                      ros::NodeHandle* node) {
  const ros::NodeHandle place(*node, "simulator");
  place.setParam("real_time_factor", parameters.real_time_factor);
  place.setParam("rate", parameters.rate);
  place.setParam("display_rate", parameters.display_rate);
  settings_ = std::make_unique<dynamic_reconfigure::Server<SimulatorConfig>>(place);
  settings_->setCallback([this, kept = parameters](SimulatorConfig& config, std::uint32_t) mutable {
    // The server keeps numbers in their ranges, but not NaN in any.
    Keep("real_time_factor", &config.real_time_factor, &kept.real_time_factor);
    Keep("rate", &config.rate, &kept.rate);
    Keep("display_rate", &config.display_rate, &kept.display_rate);
    if (config.real_time_factor > 0) {
      config.real_time_factor = std::max(config.real_time_factor, Simulator::kSmallestFactor);
    }
    simulator_->SetPace(config.real_time_factor, config.rate, config.display_rate);
  });
}

bool SimulatorServices::Pause(Empty::Request&, Empty::Response&) {
  return Simply("pause_physics", [&] { simulator_->Pause(); });
}

bool SimulatorServices::Unpause(Empty::Request&, Empty::Response&) {
  return Simply("unpause_physics", [&] { simulator_->Unpause(); });
}

bool SimulatorServices::ResetSimulation(Empty::Request&, Empty::Response&) {
  return Simply("reset_simulation",
                [&] { simulator_->Call([](Session& session) { session.ResetSimulation(); }); });
}

bool SimulatorServices::ResetWorld(Empty::Request&, Empty::Response&) {
  return Simply("reset_world",
                [&] { simulator_->Call([](Session& session) { session.ResetWorld(); }); });
}

bool SimulatorServices::Step(StepSimulation::Request& in, StepSimulation::Response& out) {
  return Guard("step", &out, [&] {
    CheckMessage(in);
    const Simulator::Steps steps = simulator_->Step(in.seconds, in.events, &out.condition);
    out.t = steps.t;
    out.events = steps.events;
    out.condition = steps.condition;
    Warn(steps.warnings, &out);
  });
}

bool SimulatorServices::SetState(SetSimulatorState::Request& in, SetSimulatorState::Response& out) {
  return Guard("set_state", &out, [&] {
    CheckMessage(in);
    out.state = simulator_->Call(
        [&](Session& session) {
          session.SetState(FromMsg(in.state));
          return StateOf(&session);
        },
        &out.condition);
  });
}

bool SimulatorServices::GetState(GetSimulatorState::Request&, GetSimulatorState::Response& out) {
  return Guard("get_state", &out, [&] {
    out.state = simulator_->Call(
        [&](Session& session) {
          out.paused = simulator_->PausedNow();
          return StateOf(&session);
        },
        &out.condition);
  });
}

bool SimulatorServices::SetInputs(SetInput::Request& in, SetInput::Response& out) {
  return Guard("set_input", &out, [&] {
    CheckMessage(in);
    out.t = simulator_->Call(
        [&](Session& session) {
          const double t = in.at != 0 ? in.at : session.now();
          if (t < session.now()) {
            throw std::invalid_argument("at is " + std::to_string(t) +
                                        ", expected 0 or a time not before the present " +
                                        std::to_string(session.now()));
          }
          session.SetInput(t, in.names, in.values);
          return t;
        },
        &out.condition);
  });
}

bool SimulatorServices::Push(ApplyImpulse::Request& in, ApplyImpulse::Response& out) {
  return Guard("apply_impulse", &out, [&] {
    CheckMessage(in);
    out.state = simulator_->Call(
        [&](Session& session) {
          session.ApplyImpulse(in.names, in.impulse);
          return StateOf(&session);
        },
        &out.condition);
  });
}

bool SimulatorServices::SetParameters(SetSimulatorParameters::Request& in,
                                      SetSimulatorParameters::Response& out) {
  return Guard("set_parameters", &out, [&] {
    CheckMessage(in);
    out.state = simulator_->Call(
        [&](Session& session) {
          session.SetParameters(in.names, in.values);
          return StateOf(&session);
        },
        &out.condition);
  });
}

bool SimulatorServices::Mark(MarkInstant::Request& in, MarkInstant::Response& out) {
  return Guard("mark", &out, [&] {
    CheckMessage(in);
    AskedMark asked;
    asked.directions = DirectionsOf(in);
    asked.by_inputs = in.by_inputs;
    asked.by_parameters = in.by_parameters;
    asked.clear = in.clear;
    const Directions marked = simulator_->Call(
        [&](Session& session) {
          out.t = session.now();
          return session.Mark(asked);
        },
        &out.condition);
    out.directions = marked.names;
    Warn(ToMsg(marked.notes), &out);
  });
}

bool SimulatorServices::PredictFrom(PredictOutcome::Request& in, PredictOutcome::Response& out) {
  return Guard("predict", &out, [&] {
    CheckMessage(in);
    AskedPrediction asked;
    asked.horizon = in.horizon;
    asked.directions = DirectionsOf(in);
    asked.size = in.size;
    const Snapshot snapshot = simulator_->Call(
        [&](Session& session) { return session.AskPrediction(&asked); }, &out.condition);
    Prediction prediction;
    AnswerWithin<SimulateTrajectory::Response>(pool_, "predict", LimitsOf(*snapshot.setup, {}),
                                               &out.prediction, [&] {
                                                 prediction = Predict(snapshot, asked, &IsStopping);
                                                 return ToMsg(prediction);
                                               });
    out.outcome = out.prediction.outcome;
    out.message = out.prediction.message;
    const bool ended = out.outcome == static_cast<int>(Outcome::kCancelled) ||
                       out.outcome == static_cast<int>(Outcome::kBudgetExceeded);
    if (ended) return;  // nobody could repeat it
    simulator_->Call([&](Session& session) { session.TellPrediction(prediction); });
  });
}

}  // namespace ros_interface
}  // namespace contact_flow
