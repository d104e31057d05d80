// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <iosfwd>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chain_check.h"
#include "src/ros/recording/bag_reader.h"
#include "src/ros/recording/deserialize.h"
#include "verify_session.h"

namespace contact_flow {
namespace ros_interface {

/// What became of the messages of bags.
struct Verification {
  int verified = 0;   ///< computed again with the same bits, or copies of these
  int differing = 0;  ///< messages, links and models that are not what was recorded or computed
  int skipped = 0;    ///< messages of kinds that this package does not record
  int gaps = 0;       ///< reasons why something could not be verified
};

/// Computes everything in bags again, with the model and the settings that the bags say, and
/// compares it bit for bit; and follows the hash chain over what was recorded (docs/security.md).
/// The recording of a simulator is repeated from its epochs, inputs and marks. Prints a line for
/// every result, and for everything that differs or that cannot be verified.
class BagVerifier {
 public:
  struct Options {
    std::shared_ptr<const SigningKey> key;  ///< that must have signed, or null
    double max_seconds = 3600;              ///< for each result
  };
  BagVerifier(std::ostream* out, Options options);
  ~BagVerifier();

  /// The next bag: the parts of a recording are given in their order. Throws std::runtime_error for
  /// a file that is not a bag, or damaged.
  void Take(const std::string& path);
  /// After the last.
  const Verification& Finish();

 private:
  class Repeater;

  void EndRecording();
  void Handle(const BagMessage& message);
  template <class Type>
  bool Record(const BagMessage& message, const Type& type);
  template <class Topic>
  bool Copy(const BagMessage& message, const Topic& topic);
  template <class Message>
  bool Online(const BagMessage& message, const char* role, bool announced = false);
  bool Shown(const BagMessage& message);
  bool Start(const BagMessage& message);
  bool Link(const BagMessage& message);
  bool Model(const BagMessage& message);
  bool TakeResult(const BagMessage& message);
  bool TakeOnline(const BagMessage& message);
  /// Deserialized, with its topic, sender and stamp checked.
  template <class Message>
  Message Get(const BagMessage& message, const std::string& role);
  void CheckStamp(const BagMessage& message, const ros::Time& stamp);
  void CheckTopic(const BagMessage& message, const std::string& role);
  std::string RoleOf(const BagMessage& message) const;

  void Line(const BagMessage& message, const std::string& verdict);
  void Differs(const BagMessage& message, const std::string& how);
  void Gap(const std::string& what);

  std::ostream* out_;
  const Options options_;
  ChainCheck chain_;
  SessionVerifier session_;
  std::unique_ptr<Repeater> repeater_;
  std::optional<RecordingStart> start_;
  std::map<std::string, std::string> roles_;  // by topic
  std::map<std::string, Bytes> copies_;       // to come, of the last record, by type
  std::string path_;
  std::size_t number_ = 0, sound_ = 0;  // of the present message in its bag; see ChainCheck
  bool goes_on_ = false;
  ros::Time time_;  // of the message before
  Verification result_;
};

template <class Message>
Message BagVerifier::Get(const BagMessage& message, const std::string& role) {
  CheckTopic(message, role);
  Message value = Deserialize<Message>(message);
  CheckStamp(message, value.header.stamp);
  return value;
}

/// The command verify_bag. 0: something was verified, and nothing differs or is missing; 1:
/// something differs, is damaged, cannot be read, or there is nothing to verify; 2: wrong use; 3:
/// nothing differs, but not everything could be verified.
int RunVerifyBag(int argc, char** argv);

}  // namespace ros_interface
}  // namespace contact_flow
