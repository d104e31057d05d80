// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "contact_flow/InputCommand.h"
#include "contact_flow/ResultWarning.h"
#include "contact_flow/SimulatorCondition.h"
#include "contact_flow/SimulatorSettings.h"
#include "contact_flow/SimulatorStatus.h"
#include "joint_commands.h"
#include "pace.h"
#include "simulator_topics.h"
#include "src/ros/display/stamps.h"
#include "src/session/session.h"

namespace contact_flow {
namespace ros_interface {

/// The private parameters of the simulator.
struct SimulatorParameters {
  bool online = false;          ///< ~online: the node is a simulator, too
  bool paused = true;           ///< ~paused: at the start
  double real_time_factor = 1;  ///< ~real_time_factor; 0: as fast as possible
  double rate = 100;            ///< ~rate of states [1/s of simulated time]
  double display_rate = 50;     ///< ~display_rate of joint_states, tf, markers, wrenches, likewise
  double control_rate = 500;    ///< ~control_rate at which JointTrajectory is sampled, likewise
  bool publish_clock = false;   ///< ~publish_clock; by default, whether /use_sim_time is set
  bool use_sim_time = false;    ///< /use_sim_time
  std::vector<std::string> tangent_directions;  ///< ~tangent_directions of the rolling derivative
  bool mark = false;                            ///< ~mark the start
  long realtime_priority =
      0;  ///< ~realtime_priority of the simulation thread, 1 to 99 (SCHED_FIFO); 0: none
  /// ~step_seconds: the longest that 10 ms of the motion may take [s of processor time]
  double step_seconds = 2;
  bool busy_wait = false;       ///< ~busy_wait: that thread does not sleep between two instants
  double bag_split_size = 128;  ///< ~bag_split_size of the parts of NAME_online.bag [MB]
  /// ~signing_key: path of a private Ed25519 key (PEM) that signs recordings; "": none
  std::shared_ptr<const SigningKey> signing_key;
  DisplayOptions display;  ///< ~tf_prefix, ~base_frame
};

/// Runs a session along with the clock, in a thread of its own which owns it. Everybody else posts
/// commands, which the thread carries out between two instants of the simulation, at most
/// kLookAhead apart.
///
/// What belongs to an instant is computed before and published when the instant is
/// due, never earlier.
class Simulator {
 public:
  static constexpr double kLookAhead = 2e-3;       ///< [s] by either clock
  static constexpr double kSmallestFactor = 1e-3;  ///< of real time, unless 0

  Simulator(const SimulatorParameters& parameters, const Configuration& configuration,
            ros::NodeHandle* node, const std::string& bag_directory);
  ~Simulator();

  void Start();

  /// Carries out `command(session)` in the simulation thread, and returns what it returns or throws
  /// what it throws. `condition`, if not null, receives how it stands right after, in either case.
  /// Throws std::runtime_error when the node shuts down meanwhile.
  template <class Command>
  auto Call(Command command, SimulatorCondition* condition = nullptr) {
    using Result = std::invoke_result_t<Command, Session&>;
    std::packaged_task<Result()> task([this, command = std::move(command), condition] {
      const Afterwards tell{this, condition};
      return command(session_);
    });
    std::future<Result> result = task.get_future();
    auto shared = std::make_shared<std::packaged_task<Result()>>(std::move(task));
    // Not to be kept here: the promise breaks when whoever drops the command drops the last of it.
    Post([shared = std::move(shared)] { (*shared)(); });
    try {
      return result.get();
    } catch (const std::future_error&) {
      throw std::runtime_error("the node is shutting down");
    }
  }
  /// The same without waiting.
  void Post(std::function<void()> command);

  void Pause();
  /// Throws std::invalid_argument when the run has come to an end.
  void Unpause();
  /// For commands.
  bool PausedNow() const { return paused_; }
  /// Does it go on and, if not, why? For commands, too.
  SimulatorCondition ConditionNow() const;
  struct Steps {
    double t = 0;
    std::uint32_t events = 0;
    std::vector<ResultWarning> warnings;  ///< why it stopped before it was done
    SimulatorCondition condition;
  };
  /// While paused: goes on to now + seconds, or to so many events. Waits until done. `condition`
  /// is told also when this throws, because it must not be.
  Steps Step(double seconds, std::uint32_t events, SimulatorCondition* condition);
  void TakeInput(const InputCommand& input);
  /// Commands to joints, as inputs (JointCommands): of a robot, but the second; stamps likewise.
  void TakeJoints(const sensor_msgs::JointState& command);
  void TakeNumbers(const std_msgs::Float64MultiArray& command);
  /// Takes the place of the trajectory before; one without points ends it.
  void TakeTrajectory(const trajectory_msgs::JointTrajectory& trajectory);
  void SetPace(double real_time_factor, double rate, double display_rate);
  /// Before Start, from the very beginning.
  std::string StartRecording(const std::string& name);
  std::vector<std::string> StopRecording();

  /// How it is doing; the first of the calls within a second resets the figures of the last one.
  SimulatorStatus Status();
  void PublishStatus();

 private:
  SimulatorSettings Settings() const;
  std::string Record(const std::string& name, const ros::Time& stamp);
  struct Stepping {
    double end;
    std::uint32_t wanted, passed;
    std::promise<Steps> done;
  };

  /// Tells the condition when a command is over.
  struct Afterwards {
    const Simulator* simulator;
    SimulatorCondition* condition;
    ~Afterwards() {
      if (condition != nullptr) *condition = simulator->ConditionNow();
    }
  };

  void Run();
  void RunCommands();
  void Wait(double seconds);
  /// Waits until t is due; false when the thread is to stop.
  bool WaitUntilDue(double t);
  void Go();
  void Stop();
  void EndSteps(const std::vector<ResultWarning>& warnings);
  void AfterCommands();
  void CountTicks();
  /// What the session tells, to be published in its order.
  Session::Log Log();
  template <class Told>
  std::function<void(const Told&)> Later() {
    return [this](const Told& told) {
      log_.push_back(
          [this, message = ToMsg(told)](const ros::Time& stamp) { topics_.Tell(message, stamp); });
    };
  }
  void TellLog();
  /// What there is to tell of now, to be sent off when it is due.
  void Compose(bool event, bool display);
  void KeepInTouch();
  void Note(bool published);
  double NextInstant() const;
  /// Simulated time of a stamp; now, and counted, where it has passed.
  double TimeOf(const ros::Time& stamp);
  JointCommands Joints() const;
  /// The inputs of the trajectory, at instants of the control rate.
  void FollowTrajectory();

  SimulatorParameters parameters_;
  SimulatorTopics topics_;
  std::vector<std::function<void(const ros::Time&)>> log_;  // to be told before anything else
  Session session_;
  Pace pace_;
  Stamps stamps_;
  bool paused_;
  std::string pause_ = "paused from the start (~paused)";  // who has paused it
  bool touched_ = true;  // a command has changed something that is to be published
  bool status_asked_ = false;
  std::uint32_t seen_epoch_ = 0;
  std::optional<Stepping> stepping_;
  std::optional<TrajectoryFollower> trajectory_;
  long control_tick_ = 0;
  Pace::Clock::time_point last_state_{}, last_touch_{};
  long tick_ = 0, display_tick_ = 0;

  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<std::function<void()>> commands_;
  bool stopping_ = false;
  SimulatorStatus status_;
  double lateness_ = 0;
  // For rates over the last second.
  Pace::Clock::time_point window_begin_ = Pace::Clock::now();
  double window_t_ = 0;
  std::uint64_t window_events_ = 0;

  std::thread thread_;
};

}  // namespace ros_interface
}  // namespace contact_flow
