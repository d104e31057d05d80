// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Float64MultiArray.h>
#include <trajectory_msgs/JointTrajectory.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/InputCommand.h"
#include "test/ros/siege.h"

namespace contact_flow {
namespace fuzz {

/// One client of hostile_test.
class Besieger {
 public:
  explicit Besieger(Siege* siege)
      : siege_(*siege),
        input_(node_.advertise<InputCommand>("/besieged/input", 10)),
        joints_(node_.advertise<sensor_msgs::JointState>("/legged/joint_commands", 10)),
        numbers_(node_.advertise<std_msgs::Float64MultiArray>("/legged/commands", 10)),
        trajectory_(
            node_.advertise<trajectory_msgs::JointTrajectory>("/legged/joint_trajectory", 10)) {}

  void Run() {
    unsigned long number = 0;
    while (siege_.Take(&number)) {
      number_ = number;
      std::mt19937 dice(static_cast<unsigned>(number));
      const unsigned kind = dice() % 1000;
      if (kind < 80) {
        SendMessage(&dice);
      } else if (kind < 100) {
        Set(&dice);
      } else if (kind < 102) {
        Record(&dice);
      } else {
        Send(&dice);
      }
      if (number % 100 == 0) AskGood();
      if (number % 100 == 50) LookAtLegs();
    }
  }

 private:
  std::string What(const std::string& service) const {
    return service + " of request " + std::to_string(number_);
  }

  /// Calls with bytes of any kind. Is the answer one? `answer` holds it then.
  bool Call(const std::string& service, const std::string& md5sum, const ros_if::Bytes& bytes,
            ros::SerializedMessage* answer) {
    const auto size = static_cast<std::uint32_t>(bytes.size());
    ros::SerializedMessage request;
    request.num_bytes = size + 4;
    request.buf.reset(new std::uint8_t[request.num_bytes]);
    std::memcpy(request.buf.get(), &size, 4);
    if (size > 0) std::memcpy(request.buf.get() + 4, bytes.data(), size);
    request.message_start = request.buf.get() + 4;
    // roscpp may drop a connection before the answer (ros_comm#1976): once more.
    for (int attempt = 0;; ++attempt) {
      ros::ServiceClient& client = clients_[service];
      if (!client.isValid()) {
        ros::ServiceClientOptions options(service, md5sum, true, {});
        client = node_.serviceClient(options);
      }
      siege_.Ask(What(service));
      const bool called = client.call(request, *answer, md5sum);
      siege_.Answered();
      if (called || client.isValid()) return called;
      ++siege_.dropped_;
      if (attempt == 2) {
        siege_.AddWrongLocked(What(service) + ": no connection");
        return false;
      }
    }
  }
  template <class Service>
  bool Call(const std::string& service, Service* call) {
    ros::SerializedMessage answer;
    if (!Call(service, ros::service_traits::MD5Sum<Service>::value(),
              ros_if::Serialize(call->request), &answer)) {
      return false;
    }
    ros::serialization::deserializeMessage(answer, call->response);
    return true;
  }

  void Send(std::mt19937* dice) {
    const WireKind& kind = siege_.AnyKind(dice);
    HostileRequest request = kind.make(siege_.seeds(), dice);
    const bool damaged = (*dice)() % 32 == 0 && !request.bytes.empty();
    if (damaged) Damage(dice, &request.bytes);
    ros::SerializedMessage answer;
    const bool told = Call("/besieged/" + kind.service, kind.md5sum, request.bytes, &answer);
    const std::size_t header = static_cast<std::size_t>(answer.message_start - answer.buf.get());
    const std::size_t size = answer.num_bytes - header;
    if (!told) {
      ++siege_.failed_;
      const bool simple = kind.fields.empty();  // it has no other way to refuse
      if (!damaged && !simple) siege_.AddWrongLocked(What(kind.service) + " has failed");
    } else if (size >= 5) {
      std::uint32_t length = 0;
      std::memcpy(&length, answer.message_start + 1, 4);
      const auto* text = reinterpret_cast<const char*>(answer.message_start + 5);
      const bool success = *answer.message_start != 0;
      if (damaged) {
        ++siege_.failed_;
      } else {
        siege_.Judge(kind, request, success, {text, std::min<std::size_t>(length, size - 5)},
                     What(kind.service));
      }
    }
  }

  /// Cuts off, prolongs, flips a bit, or announces more entries than there are: 2^32 - 1, 2^30 - 1
  /// or 2^20.
  static void Damage(std::mt19937* dice, ros_if::Bytes* bytes) {
    const std::size_t at = (*dice)() % bytes->size();
    switch ((*dice)() % 4) {
      case 0:
        bytes->resize(at);
        break;
      case 1:
        bytes->insert(bytes->end(), 1 + (*dice)() % 100, static_cast<std::uint8_t>((*dice)()));
        break;
      case 2:
        (*bytes)[at] ^= static_cast<std::uint8_t>(1u << ((*dice)() % 8));
        break;
      default: {
        static constexpr std::uint32_t kLies[] = {0xffffffff, 0x3fffffff, 0x00100000};
        const std::uint32_t lie = kLies[(*dice)() % 3];
        if (at + 4 <= bytes->size()) std::memcpy(bytes->data() + at, &lie, 4);
      }
    }
  }

  void AskGood() {
    SimulateTrajectory good;
    good.request.duration = siege_.seeds().good.duration;
    if (!Call("/besieged/simulate", &good) || !good.response.success) {
      siege_.AddWrongLocked(What("a good request") + ": " + good.response.message);
    } else {
      siege_.JudgeGood(&good.response.trajectory);
    }
  }

  /// Topics tell nobody what they think of a message: the robot's state is looked at, and set back
  /// when it has flown apart.
  void LookAtLegs() {
    GetSimulatorState look;
    std_srvs::Empty empty;
    if (!Call("/legged/get_state", &look) || !look.response.success) {
      siege_.AddWrongLocked(What("get_state") + ": " + look.response.message);
    } else if (look.response.condition.outcome != 0) {
      Call("/legged/reset_simulation", &empty);
      Call("/legged/unpause_physics", &empty);
    } else {
      for (const auto* part : {&look.response.state.q, &look.response.state.v}) {
        for (const double number : *part) {
          if (!std::isfinite(number)) siege_.AddWrongLocked(What("the robot") + " is not finite");
        }
      }
    }
  }

  void SendMessage(std::mt19937* dice) {
    const std::vector<std::string> joints = {"front_left_knee", "rear_right_knee",
                                             "front_left_roll"};
    MessageMutator mutator(dice, joints);
    switch ((*dice)() % 4) {
      case 0: {
        MessageMutator own(dice, siege_.seeds().words);
        InputCommand command;
        command.values = siege_.seeds().U();
        own.Mutate(&command);
        input_.publish(command);
        break;
      }
      case 1: {
        sensor_msgs::JointState command;
        command.name = joints;
        command.position = {-1.3, -1.3, 0.1};
        mutator.Mutate(&command);
        joints_.publish(command);
        break;
      }
      case 2: {
        std_msgs::Float64MultiArray command;
        command.data.assign(12, 0.1);
        mutator.Mutate(&command);
        numbers_.publish(command);
        break;
      }
      default: {
        trajectory_msgs::JointTrajectory command;
        command.joint_names = joints;
        command.points.resize(2);
        for (std::size_t k = 0; k < 2; ++k) {
          command.points[k].positions = {-1.3, -1.3, 0.1};
          command.points[k].time_from_start = ros::Duration(0.01 * static_cast<double>(k + 1));
        }
        mutator.Mutate(&command);
        trajectory_.publish(command);
      }
    }
    ++siege_.messages_;
  }

  /// A hostile setting, whose answer must be finite, and back: nobody waits for a run that is a
  /// thousand times as fast.
  void Set(std::mt19937* dice) {
    static const char* const kNames[] = {"rate", "real_time_factor", "display_rate"};
    MessageMutator mutator(dice, {kNames, kNames + 3});
    dynamic_reconfigure::Reconfigure call;
    dynamic_reconfigure::DoubleParameter setting;
    setting.name = kNames[(*dice)() % 3];
    setting.value = mutator.Number(1);
    call.request.config.doubles = {setting};
    if ((*dice)() % 4 == 0) mutator.Mutate(&call.request);
    const std::string service = "/besieged/simulator/set_parameters";
    if (!Call(service, &call)) siege_.AddWrongLocked(What(service) + " has failed");
    for (const auto& now : call.response.config.doubles) {
      if (!std::isfinite(now.value)) siege_.AddWrongLocked(What(service) + ": " + now.name);
    }
    call.request.config.doubles.resize(2);
    call.request.config.doubles[0].name = "real_time_factor";
    call.request.config.doubles[0].value = 1;
    call.request.config.doubles[1].name = "rate";
    call.request.config.doubles[1].value = 100;
    Call(service, &call);
    ++siege_.settings_;
  }

  /// Begins a recording under a hostile name, and ends it where that is a good one.
  void Record(std::mt19937* dice) {
    MessageMutator mutator(dice, {"run", "../run", "/tmp/run", ".", "..", "run.bag", "a/b", "-"});
    StartRecording start;
    mutator.Mutate(&start.request);
    StopRecording stop;
    if (!Call("/besieged/start_recording", &start) || !Call("/besieged/stop_recording", &stop)) {
      siege_.AddWrongLocked(What("recording") + " has failed");
    }
    if (!start.response.success && start.response.message.size() < 5) {
      siege_.AddWrongLocked(What("start_recording") + " is refused without words");
    }
    for (const std::string& path : stop.response.paths) std::remove(path.c_str());
    ++siege_.recordings_;
  }

  Siege& siege_;
  unsigned long number_ = 0;
  ros::NodeHandle node_;
  ros::Publisher input_, joints_, numbers_, trajectory_;
  std::map<std::string, ros::ServiceClient> clients_;
};

}  // namespace fuzz
}  // namespace contact_flow
