// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/serialization.h>

#include <cstdint>
#include <stdexcept>

#include "serialize.h"

namespace contact_flow {
namespace ros_interface {

/// A message as one of another name with the same fields, of the same types in the same order: what
/// a service is asked, as the request that its record holds. Calls from a shell stay flat so.
/// test/layout/messages_test.py holds the definitions to it.
template <class To, class From>
To SameFields(const From& from) {
  Bytes bytes = Serialize(from);
  ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  To to;
  ros::serialization::deserialize(stream, to);
  if (stream.getLength() != 0)
    throw std::logic_error("messages that were to have the same fields have not");
  return to;
}

}  // namespace ros_interface
}  // namespace contact_flow
