// SPDX-License-Identifier: BSD-3-Clause
// What others ask of the simulation thread.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simulator.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kLongestSteps = 1e6;   // [s]
constexpr double kUsualEventWait = 10;  // [s]

std::string EndOfRun(const Status& status) {
  return "the run has come to its end: " + status.message + "; reset it or set a state";
}

}  // namespace

SimulatorCondition Simulator::ConditionNow() const {
  const contact_flow::Status& status = session_.status();
  SimulatorCondition condition;
  condition.paused = paused_;
  condition.outcome = static_cast<std::uint8_t>(status.outcome);
  condition.why = !status.ok() ? EndOfRun(status) : paused_ ? pause_ : "";
  return condition;
}

void Simulator::Pause() {
  Call([this](Session& session) {
    paused_ = true;
    pause_ = "paused by pause_physics";
    touched_ = true;
    EndSteps({MakeWarning(ResultWarning::STEP_CUT, "paused", session.now())});
  });
}

void Simulator::Unpause() {
  Call([this](Session& session) {
    if (!session.status().ok()) {
      throw std::invalid_argument(EndOfRun(session.status()));
    }
    EndSteps({MakeWarning(ResultWarning::STEP_CUT, "unpaused", session.now())});
    paused_ = false;
    pace_.Anchor(session.now(), pace_.factor());
    if (!parameters_.publish_clock && !ros::Time::now().isZero()) {
      stamps_.Anchor(session.now(), ros::Time::now());
    }
  });
}

Simulator::Steps Simulator::Step(double seconds, std::uint32_t events,
                                 SimulatorCondition* condition) {
  const auto begin = [=](Session& session) {
    if (!(seconds >= 0) || seconds > kLongestSteps) {
      throw std::invalid_argument("seconds is " + std::to_string(seconds) + ", expected 0 to 1e6");
    }
    if (seconds == 0 && events == 0) {
      throw std::invalid_argument("seconds and events are both 0, expected one of them");
    }
    if (!paused_) throw std::invalid_argument("the simulation is running: pause_physics first");
    if (stepping_) throw std::invalid_argument("steps are being taken already");
    if (!session.status().ok()) {
      throw std::invalid_argument(EndOfRun(session.status()));
    }
    stepping_.emplace();
    stepping_->end = session.now() + (seconds > 0 ? seconds : kUsualEventWait);
    stepping_->wanted = events;
    stepping_->passed = 0;
    return stepping_->done.get_future();
  };
  std::future<Steps> done = Call(begin, condition);
  try {
    return done.get();
  } catch (const std::future_error&) {
    throw std::runtime_error("the node is shutting down");
  }
}

void Simulator::TakeInput(const InputCommand& input) {
  Post([this, input] {
    try {
      CheckMessage(input);
      session_.SetInput(TimeOf(input.header.stamp), input.names, input.values);
    } catch (const std::exception& error) {
      ROS_WARN_THROTTLE(1, "input: %s", error.what());
    }
  });
}

double Simulator::TimeOf(const ros::Time& stamp) {
  const double now = session_.now();
  const double t = stamp.isZero() ? now : stamps_.TimeOf(stamp);
  if (t >= now) return t;
  const std::lock_guard<std::mutex> lock(mutex_);
  ++status_.late_inputs;
  return now;
}

void Simulator::SetPace(double real_time_factor, double rate, double display_rate) {
  Call([=](Session& session) {
    parameters_.rate = rate;
    parameters_.display_rate = display_rate;
    CountTicks();
    pace_.Anchor(session.now(), real_time_factor);
    topics_.Tell(Settings(), std::max(stamps_.last(), stamps_.At(session.now())));
  });
}

SimulatorSettings Simulator::Settings() const {
  SimulatorSettings settings;
  settings.real_time_factor = pace_.factor();
  settings.rate = parameters_.rate;
  settings.display_rate = parameters_.display_rate;
  return settings;
}

/// Begins with what the node was set to, and with how fast it goes now.
std::string Simulator::Record(const std::string& name, const ros::Time& stamp) {
  RecordingStart start;
  const auto set = [&](const std::string& key, const std::string& value) {
    start.setting_names.push_back(key);
    start.setting_values.push_back(value);
  };
  set("publish_clock", parameters_.publish_clock ? "true" : "false");
  set("tf_prefix", parameters_.display.prefix);
  set("base_frame", parameters_.display.base_frame);
  set("world_frame", parameters_.display.world_frame);
  for (const std::string& direction : parameters_.tangent_directions) {
    set("tangent_directions", direction);
  }
  set("bag_split_size", std::to_string(parameters_.bag_split_size));
  for (const Parameter& parameter : session_.initial_setup().system->description().parameters) {
    start.parameter_names.push_back(parameter.name);
    start.parameter_values.push_back(parameter.value);
  }
  const std::string path = topics_.StartRecording(name, stamp, start);
  topics_.Tell(Settings(), stamp);
  return path;
}

std::string Simulator::StartRecording(const std::string& name) {
  if (!thread_.joinable()) return Record(name, stamps_.At(session_.now()));
  return Call([this, name](Session& session) {
    TellLog();
    topics_.SendOff();
    const std::string path = Record(name, stamps_.last());
    session.BeginEpoch("start_recording");  // what can be repeated begins here
    return path;
  });
}

std::vector<std::string> Simulator::StopRecording() {
  Call([this](Session&) { topics_.CloseRecording(); });
  return topics_.FinishRecording();  // the simulation does not wait for the disk
}

/// Keeps the figures of `status`.
void Simulator::Note(bool published) {
  const Margins margins = session_.margins();
  const Vector force = session_.status().ok() ? session_.Force() : Vector();
  const SystemDescription& description = session_.setup()->system->description();
  const std::string why = ConditionNow().why;
  const double late = published && !stepping_ ? pace_.Lateness(session_.now()) : 0;
  const std::lock_guard<std::mutex> lock(mutex_);
  lateness_ = std::max(lateness_, late);
  status_.largest_lateness = std::max(status_.largest_lateness, late);
  status_.paused = paused_;
  status_.outcome = static_cast<std::uint8_t>(session_.status().outcome);
  status_.message = session_.status().message;
  status_.why = why;
  status_.epoch = session_.epoch();
  status_.events = session_.events();
  status_.t = session_.now();
  status_.real_time_factor = pace_.factor();
  status_.mode = session_.mode().Names(description.constraints);
  status_.mode_word = ToWord(description.constraints, session_.mode());
  status_.constraints = description.constraints;
  const auto n = static_cast<Eigen::Index>(description.constraints.size());
  status_.force = ToMsg(VectorRef(force.head(std::min(n, force.size()))));
  status_.tangential_force = Tangential(description, force);
  status_.margins = ToMsg(margins);
}

SimulatorStatus Simulator::Status() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = Pace::Clock::now();
  const double length = std::chrono::duration<double>(now - window_begin_).count();
  if (length >= 1) {
    status_.achieved_factor = std::max(0.0, status_.t - window_t_) / length;
    status_.events_per_second = status_.events >= window_events_
                                    ? static_cast<double>(status_.events - window_events_) / length
                                    : 0;
    status_.lateness = lateness_;
    lateness_ = 0;
    window_begin_ = now;
    window_t_ = status_.t;
    window_events_ = status_.events;
  }
  return status_;
}

void Simulator::PublishStatus() {
  Post([this] { status_asked_ = true; });
}

}  // namespace ros_interface
}  // namespace contact_flow
