// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/message_traits.h>
#include <ros/time.h>

#include <boost/shared_ptr.hpp>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bag_format.h"
#include "contact_flow/RecordingStart.h"
#include "record_chain.h"
#include "src/ros/message/serialize.h"

namespace contact_flow {
namespace ros_interface {

/// A message on its way to a bag; it is serialized by who writes.
struct BagEntry {
  BagConnection connection;
  std::function<Bytes()> bytes;
};

/// The connections of what one node records. For one thread.
class BagConnections {
 public:
  explicit BagConnections(std::string caller) : caller_(std::move(caller)) {}

  /// One that is latched is latched by `rosbag play`, too.
  template <class Message>
  BagConnection Of(const std::string& topic, bool latched) {
    BagConnection& connection = connections_[topic];
    if (!connection) {
      connection = std::make_shared<const BagFields>(
          BagFields{{"topic", topic},
                    {"type", ros::message_traits::DataType<Message>::value()},
                    {"md5sum", ros::message_traits::MD5Sum<Message>::value()},
                    {"message_definition", ros::message_traits::Definition<Message>::value()},
                    {"callerid", caller_},
                    {"latching", latched ? "1" : "0"}});
    }
    return connection;
  }
  template <class Message>
  BagEntry Entry(const std::string& topic, boost::shared_ptr<const Message> message,
                 bool latched = true) {
    return {Of<Message>(topic, latched), [message] { return Serialize(*message); }};
  }

 private:
  const std::string caller_;
  std::map<std::string, BagConnection> connections_;
};

/// What a recording is, before it begins.
struct RecordingPlan {
  /// Fills in node and version, and the connections below `name`, the private name of the node.
  RecordingPlan(const std::string& kind, const std::string& name, BagConnections* connections);

  RecordingStart start;  ///< header, recording, part, messages, previous and key are left empty
  BagConnection start_connection, link_connection;
  std::vector<BagEntry> preamble;         ///< what every part begins with, after its start
  std::shared_ptr<const SigningKey> key;  ///< or null
};

/// The bytes of the bags of one recording, with the chain over them: each call answers what is to
/// be put at the end of the file. A copy is the recording as it was.
class ChainedBag {
 public:
  explicit ChainedBag(const RecordingPlan& plan) : plan_(plan), chain_(plan.key) {}

  /// Begins the next part; what comes before must have ended with PART_ENDS.
  std::string Begin(const ros::Time& stamp);
  /// Times in the bag increase: that of an entry is its stamp, or the next after the last.
  std::string Add(const BagEntry& entry, const ros::Time& stamp);
  std::string Link(std::uint8_t state);
  std::string End() { return encoder_.End(); }
  std::string Head() const { return encoder_.Head(); }

  std::size_t size() const { return encoder_.size(); }  ///< of the present part [bytes]
  std::uint64_t messages() const { return chain_.messages(); }
  std::uint32_t unlinked() const { return chain_.open(); }  ///< messages since the last link
  const ros::Time& time() const { return time_; }           ///< of the last message

 private:
  const ros::Time& NextTime(const ros::Time& stamp);

  RecordingPlan plan_;
  RecordChain chain_;
  BagEncoder encoder_;
  std::map<BagConnection, Digest> hashes_;
  ros::Time time_;
  std::uint32_t parts_ = 0;
};

}  // namespace ros_interface
}  // namespace contact_flow
