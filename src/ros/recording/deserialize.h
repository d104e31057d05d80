// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <cstddef>
#include <new>
#include <stdexcept>
#include <string>

#include "bag_reader.h"
#include "src/ros/message/serialize.h"

namespace contact_flow {
namespace ros_interface {

/// The most that one allocation may be [bytes].
inline std::size_t& AllocationLimit() {
  thread_local std::size_t limit = 0;
  return limit;
}

/// An allocator that refuses more than a message of some size can need: one whose lengths lie
/// would otherwise have memory filled to no end before that is noticed.
template <class T>
struct ModestAllocator {
  using value_type = T;
  template <class Other>
  struct rebind {  // NOLINT: the standard's name
    using other = ModestAllocator<Other>;
  };
  ModestAllocator() = default;
  template <class Other>
  ModestAllocator(const ModestAllocator<Other>&) {}
  T* allocate(std::size_t n) {
    if (n > AllocationLimit() / sizeof(T)) throw std::bad_alloc();
    return static_cast<T*>(::operator new(n * sizeof(T)));
  }
  void deallocate(T* pointer, std::size_t) { ::operator delete(pointer); }
  template <class Other>
  bool operator==(const ModestAllocator<Other>&) const {
    return true;
  }
  template <class Other>
  bool operator!=(const ModestAllocator<Other>&) const {
    return false;
  }
};
template <class Message>
struct ModestOf;
template <template <class> class Message, class Allocator>
struct ModestOf<Message<Allocator>> {
  using Type = Message<ModestAllocator<void>>;
};

template <class Message>
void DeserializeAll(const BagMessage& message, Message* value) {
  // The stream only reads, but is declared for both.
  ros::serialization::IStream stream(const_cast<std::uint8_t*>(message.data),
                                     static_cast<std::uint32_t>(message.size));
  ros::serialization::deserialize(stream, *value);
  if (stream.getLength() != 0) throw std::runtime_error("it is too long");
}

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
    // An element of 4 bytes or more takes at most a few hundred in memory.
    AllocationLimit() = 1024 + 256 * message.size;
    typename ModestOf<Message>::Type modest;
    DeserializeAll(message, &modest);
    DeserializeAll(message, &value);
  } catch (const std::exception& error) {  // also of lengths that no memory holds
    throw std::runtime_error("no " + type + ": " + error.what());
  }
  return value;
}

}  // namespace ros_interface
}  // namespace contact_flow
