// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/serialization.h>

#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

namespace contact_flow {
namespace ros_interface {

/// A message as it travels: what is compared bit for bit.
using Bytes = std::vector<std::uint8_t>;

template <class Message>
Bytes Serialize(const Message& message) {
  Bytes bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

/// The first line in which the two messages, written out in full, differ.
template <class Message>
std::string FirstDifference(const Message& recorded, const Message& computed) {
  std::stringstream a;
  std::stringstream b;
  a.precision(17);
  b.precision(17);
  a << recorded;
  b << computed;
  std::string line_a;
  std::string line_b;
  while (std::getline(a, line_a) && std::getline(b, line_b)) {
    if (line_a != line_b) return "recorded '" + line_a + "', computed '" + line_b + "'";
  }
  return "in the last bits";
}

}  // namespace ros_interface
}  // namespace contact_flow
