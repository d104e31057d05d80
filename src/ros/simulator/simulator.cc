// SPDX-License-Identifier: BSD-3-Clause
#include "simulator.h"

#include <pthread.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "src/ros/message/conversions.h"
#include "src/ros/message/warnings.h"
#include "src/ros/service/stopping.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kPatience = 0.1;        // [s] of waiting for commands while nothing moves
constexpr double kLongestInstant = 0.1;  // [s] of simulated time
/// Parts of step_seconds.
constexpr double kSlice = 0.01, kMarkPart = 0.25;
constexpr double kTooLate = 0.2;      // [s] behind the clock: it is set back
constexpr double kTouchPeriod = 0.5;  // [s] of publishing while nothing moves

ros::Time WallStamp() {
  ros::Time time;
  time.fromNSec(ros::WallTime::now().toNSec());
  return time;
}

/// How many instants of a rate have passed, forgiving the rounding of one.
long Tick(double t, double rate) { return static_cast<long>(std::floor(t * rate + 1e-6)); }

/// Now by ROS, or by the wall where simulated time has not begun.
ros::Time RosStamp() {
  const ros::Time now = ros::Time::now();
  return now.isZero() ? WallStamp() : now;
}

}  // namespace

Simulator::Simulator(const SimulatorParameters& parameters, const Configuration& configuration,
                     ros::NodeHandle* node, const std::string& bag_directory)
    : parameters_(parameters),
      topics_(node, bag_directory,
              static_cast<std::size_t>(parameters.bag_split_size * (std::size_t{1} << 20)),
              parameters.publish_clock, parameters.display, parameters.signing_key),
      session_(configuration, parameters.tangent_directions, Log()),
      pace_(parameters.real_time_factor),
      paused_(parameters.paused) {
  stamps_.Anchor(0, parameters_.publish_clock ? WallStamp() : RosStamp());
  session_.LimitSteps({parameters_.step_seconds, kSlice * parameters_.step_seconds,
                       kMarkPart * parameters_.step_seconds});
  session_.TakeParametersChanged();
  topics_.Model(session_.setup(), stamps_.At(0));
  topics_.SendOff();
  if (parameters_.mark) {
    AskedMark start;
    start.directions.project = true;
    session_.Mark(start);
  }
  Note(false);
}

Simulator::~Simulator() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

Session::Log Simulator::Log() {
  return {Later<EpochBegin>(),
          Later<ToldInput>(),
          Later<AskedMark>(),
          Later<AskedPrediction>(),
          Later<Prediction>(),
          [](const std::string& sentence) { ROS_WARN("simulator: %s", sentence.c_str()); }};
}

void Simulator::Start() {
  thread_ = std::thread([this] { Run(); });
}

void Simulator::Post(std::function<void()> command) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stopping_) return;
    commands_.push_back(std::move(command));
  }
  changed_.notify_all();
}

void Simulator::RunCommands() {
  std::deque<std::function<void()>> commands;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    commands.swap(commands_);
  }
  for (const std::function<void()>& command : commands) {
    try {
      command();
    } catch (const std::exception& error) {  // those of Call are told to whoever waits
      ROS_ERROR("simulator: a command failed: %s", error.what());
    }
  }
}

void Simulator::Wait(double seconds) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(seconds),
                    [&] { return stopping_ || !commands_.empty(); });
}

bool Simulator::WaitUntilDue(double t) {
  const bool waits = pace_.paced() && !stepping_;
  if (waits && parameters_.busy_wait) pace_.SpinUntil(t);  // kLookAhead at most
  std::unique_lock<std::mutex> lock(mutex_);
  if (waits) changed_.wait_until(lock, pace_.Due(t), [&] { return stopping_; });
  return !stopping_;
}

void Simulator::Run() {
  if (parameters_.realtime_priority > 0) {
    sched_param schedule{};
    schedule.sched_priority = static_cast<int>(parameters_.realtime_priority);
    const int error = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &schedule);
    if (error != 0) ROS_WARN("realtime_priority: %s; going on without", std::strerror(error));
  }
  pace_.Anchor(session_.now(), pace_.factor());
  const auto goes_on = [this] {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !stopping_ && !IsStopping();
  };
  while (goes_on()) {
    try {
      RunCommands();
      AfterCommands();
      if (paused_ && !stepping_) {
        KeepInTouch();
        Wait(kPatience);
      } else {
        Go();
      }
    } catch (const std::exception& error) {  // the epoch ends, the node goes on answering
      session_.End(contact_flow::Outcome::kNonFinite, error.what());
      Stop();
      Wait(kPatience);
    }
  }
  // Whoever still waits is told: the promises of commands and steps break.
  stepping_.reset();
  std::deque<std::function<void()>> unheard;
  const std::lock_guard<std::mutex> lock(mutex_);
  stopping_ = true;
  unheard.swap(commands_);
}

/// The next instant that belongs to a rate, or that is as far ahead as may be.
double Simulator::NextInstant() const {
  const double now = session_.now();
  double next = std::min(static_cast<double>(tick_ + 1) / parameters_.rate,
                         static_cast<double>(display_tick_ + 1) / parameters_.display_rate);
  if (pace_.paced() && !stepping_) {
    const double ahead = kLookAhead * std::min(1.0, pace_.factor());  // by either clock
    next = std::min(next, static_cast<double>(Tick(now, 1 / ahead) + 1) * ahead);
  }
  if (trajectory_) {
    next = std::min(next, static_cast<double>(control_tick_ + 1) / parameters_.control_rate);
  }
  if (stepping_) next = std::min(next, stepping_->end);
  return std::clamp(next, now, now + kLongestInstant);
}

void Simulator::Go() {
  const double next = NextInstant();
  const bool event = session_.AdvanceTo(next);
  const double now = session_.now();
  const bool ended = !session_.status().ok();
  if (!event && !ended) FollowTrajectory();
  const long tick = Tick(now, parameters_.rate);
  const long display_tick = Tick(now, parameters_.display_rate);
  // At full speed not everything that could be published is.
  const auto wall = Pace::Clock::now();
  const double since = std::chrono::duration<double>(wall - last_state_).count();
  const bool open = (pace_.paced() && !stepping_) || since * parameters_.rate >= 1;
  const bool state = (tick > tick_ && open) || event || ended;
  const bool display = (display_tick > display_tick_ && open) || ended;
  tick_ = tick;
  display_tick_ = display_tick;
  if (state || display) {
    last_state_ = wall;
    Compose(event, display);
  }
  if (!WaitUntilDue(now)) return;
  topics_.SendOff();
  Note(state);
  if (pace_.paced() && !stepping_ && pace_.Lateness(now) > kTooLate) {
    pace_.Anchor(now, pace_.factor());
    const std::lock_guard<std::mutex> lock(mutex_);
    ++status_.overruns;
  }
  if (stepping_) {
    if (event && !session_.changes_input()) ++stepping_->passed;
    if (stepping_->wanted > 0 && stepping_->passed >= stepping_->wanted) {
      EndSteps({});
    } else if (now >= stepping_->end) {
      std::vector<ResultWarning> warnings;
      if (stepping_->wanted > 0) {
        warnings = {MakeWarning(ResultWarning::NO_MORE_EVENTS, "no more events in this time", now)};
      }
      EndSteps(warnings);
    }
  }
  if (ended) {
    Stop();
    Note(false);
  }
}

/// The epoch has come to its end.
void Simulator::Stop() {
  const contact_flow::Status& status = session_.status();
  paused_ = true;
  pause_ = "paused, since the run before has come to its end: " + status.message;
  EndSteps(
      {MakeWarning(static_cast<std::uint8_t>(status.outcome), status.message, session_.now())});
  ROS_WARN("simulator: %s", status.message.c_str());
}

void Simulator::EndSteps(const std::vector<ResultWarning>& warnings) {
  if (!stepping_) return;
  touched_ = true;
  stepping_->done.set_value({session_.now(), stepping_->passed, warnings, ConditionNow()});
  stepping_.reset();
}

void Simulator::CountTicks() {
  tick_ = Tick(session_.now(), parameters_.rate);
  display_tick_ = Tick(session_.now(), parameters_.display_rate);
}

/// Publishes what commands have changed.
void Simulator::AfterCommands() {
  if (session_.TakeParametersChanged()) topics_.Model(session_.setup(), stamps_.At(session_.now()));
  if (session_.epoch() != seen_epoch_) {
    seen_epoch_ = session_.epoch();
    touched_ = true;
    trajectory_.reset();
    CountTicks();
    if (stamps_.TimeOf(stamps_.last()) > session_.now()) {  // time has begun anew
      stamps_.Anchor(session_.now(), stamps_.last());
      pace_.Anchor(session_.now(), pace_.factor());
    }
  }
  if (touched_) {
    touched_ = false;
    Compose(false, true);
    Note(false);
  } else {
    TellLog();
  }
  if (status_asked_) {  // of now, behind what it speaks of: what is recorded can be computed again
    status_asked_ = false;
    Note(false);
    topics_.Status(Status(), std::max(stamps_.last(), stamps_.At(session_.now())));
  }
  topics_.SendOff();
}

void Simulator::TellLog() {
  const ros::Time stamp = std::max(stamps_.last(), stamps_.At(session_.now()));
  for (const auto& tell : log_) tell(stamp);
  log_.clear();
}

void Simulator::Compose(bool event, bool display) {
  TellLog();
  const ros::Time stamp = stamps_.Take(session_.now());
  topics_.Clock(stamp);
  if (event) {
    topics_.Event(ToMsg(*session_.setup()->system, session_.transition(), session_.epoch(),
                        session_.events()),
                  stamp);
  }
  topics_.State(&session_, stamp);
  if (display) topics_.Show(&session_, stamp);
}

/// While nothing moves, those who have just come are shown where it stands.
void Simulator::KeepInTouch() {
  const auto wall = Pace::Clock::now();
  if (std::chrono::duration<double>(wall - last_touch_).count() < kTouchPeriod) return;
  last_touch_ = wall;
  if (!parameters_.publish_clock) stamps_.Anchor(session_.now(), RosStamp());
  const ros::Time stamp = stamps_.Take(session_.now());
  topics_.Clock(stamp);
  topics_.Show(&session_, stamp);
  topics_.SendOff();
  Note(false);
}

}  // namespace ros_interface
}  // namespace contact_flow
