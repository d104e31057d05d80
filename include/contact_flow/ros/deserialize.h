// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <stdexcept>
#include <string>

#include "contact_flow/ros/bag_reader.h"
#include "contact_flow/ros/serialize.h"

namespace contact_flow {
namespace ros_interface {

template <class Message>
bool Is(const BagMessage& message) {
  return message.connection->at("type") == ros::message_traits::DataType<Message>::value();
}

/// The message in a bag. Throws std::runtime_error, with the reason, where the bytes are not
/// exactly one message of this type and definition.
template <class Message>
Message Deserialize(const BagMessage& message) {
  const BagFields& fields = *message.connection;
  const std::string type = ros::message_traits::DataType<Message>::value();
  if (fields.at("md5sum") != ros::message_traits::MD5Sum<Message>::value() ||
      fields.at("message_definition") != ros::message_traits::Definition<Message>::value()) {
    throw std::runtime_error("written with another definition of " + type);
  }
  Message value;
  try {
    // The stream only reads, but is declared for both.
    ros::serialization::IStream stream(const_cast<std::uint8_t*>(message.data),
                                       static_cast<std::uint32_t>(message.size));
    ros::serialization::deserialize(stream, value);
    if (stream.getLength() != 0) throw std::runtime_error("it is too long");
  } catch (const std::exception& error) {  // also of lengths that no memory holds
    throw std::runtime_error("no " + type + ": " + error.what());
  }
  return value;
}

}  // namespace ros_interface
}  // namespace contact_flow
