// SPDX-License-Identifier: BSD-3-Clause
#include "chained_bag.h"

#include <algorithm>

namespace contact_flow {
namespace ros_interface {

RecordingPlan::RecordingPlan(const std::string& kind, const std::string& name,
                             BagConnections* connections)
    : start_connection(connections->Of<RecordingStart>(name + "/recording/start", true)),
      link_connection(connections->Of<RecordingLink>(name + "/recording/link", false)) {
  start.kind = kind;
  start.node = name;
  start.version = CONTACT_FLOW_VERSION;
}

const ros::Time& ChainedBag::NextTime(const ros::Time& stamp) {
  time_ = std::max(stamp, time_ + ros::Duration(0, 1));
  return time_;
}

std::string ChainedBag::Add(const BagEntry& entry, const ros::Time& stamp) {
  const Bytes data = entry.bytes();
  const auto [hash, is_new] = hashes_.emplace(entry.connection, Digest());
  if (is_new) hash->second = HashOf(*entry.connection);
  const ros::Time& time = NextTime(stamp);
  chain_.Add(hash->second, time, data);
  return encoder_.Message(entry.connection, time, data);
}

std::string ChainedBag::Begin(const ros::Time& stamp) {
  encoder_ = BagEncoder();
  std::string bytes = BagEncoder::Begin();
  RecordingStart start = plan_.start;
  start.header.stamp = std::max(stamp, time_ + ros::Duration(0, 1));
  start.recording = chain_.recording();
  start.part = parts_++;
  start.messages = chain_.messages();
  std::copy(chain_.last().begin(), chain_.last().end(), start.previous.begin());
  start.public_key = chain_.PublicHex();
  bytes += Add({plan_.start_connection, [&start] { return Serialize(start); }}, start.header.stamp);
  for (const BagEntry& entry : plan_.preamble) bytes += Add(entry, ros::Time());
  return bytes;
}

std::string ChainedBag::Link(std::uint8_t state) {
  const ros::Time& time = NextTime(ros::Time());
  return encoder_.Message(plan_.link_connection, time, Serialize(chain_.Link(time, state)));
}

}  // namespace ros_interface
}  // namespace contact_flow
