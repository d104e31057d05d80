// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include "src/session/number_checks.h"

/// The gate through which every message from outside comes before anything else looks at it: all
/// numbers are finite and at most kLargestNumber (io/map_reader.h) in size, no text or array is
/// absurdly long. It goes through all fields there are, so that none can be forgotten; what a field
/// means is judged where it is used.
namespace contact_flow {
namespace ros_interface {

/// Longest text and array of a message.
inline constexpr std::size_t kLongestText = 4096;     // [bytes]
inline constexpr std::size_t kMostEntries = 4000000;  // 64 pieces of 64×64 have a tenth

/// The names of the fields of a message, from its definition.
std::vector<std::string> FieldNames(const char* definition);

/// Walks a message as roscpp's serialization does, with the names of its fields.
class Gate {
 public:
  template <class Message>
  void Walk(const Message& message) {
    static const std::vector<std::string> names =
        FieldNames(ros::message_traits::Definition<Message>::value());
    const Place outer = place_;
    place_ = {&names, 0};
    ros::serialization::Serializer<Message>::template allInOne<Gate, const Message&>(*this,
                                                                                     message);
    place_ = outer;
  }

  /// The next field.
  template <class Field>
  void next(const Field& field) {
    const std::size_t length = path_.size();
    if (length > 0) path_ += '.';
    path_ += place_.names->at(place_.next++);
    Pass(field);
    path_.resize(length);
  }

 private:
  struct Place {
    const std::vector<std::string>* names = nullptr;
    std::size_t next = 0;
  };

  void PassNumber(double number) const;
  void PassNumbers(const double* numbers, std::size_t count) const;
  void PassSize(std::size_t size, std::size_t largest, const char* of) const;

  void Pass(const std::string& text) { PassSize(text.size(), kLongestText, "bytes"); }
  void Pass(const ros::Time&) {}
  void Pass(const ros::Duration&) {}
  template <class Entry, class Allocator>
  void Pass(const std::vector<Entry, Allocator>& entries) {
    PassSize(entries.size(), kMostEntries, "entries");
    if constexpr (std::is_same_v<Entry, double>) {
      PassNumbers(entries.data(), entries.size());
    } else if constexpr (!std::is_arithmetic_v<Entry>) {
      const std::size_t length = path_.size();
      for (std::size_t i = 0; i < entries.size(); ++i) {
        path_ += "[" + std::to_string(i) + "]";
        Pass(entries[i]);
        path_.resize(length);
      }
    }
  }
  template <class Field>
  void Pass(const Field& field) {
    if constexpr (std::is_floating_point_v<Field>) {
      PassNumber(static_cast<double>(field));
    } else if constexpr (!std::is_arithmetic_v<Field>) {
      Walk(field);
    }
  }

  std::string path_;
  Place place_;
};

/// Throws std::invalid_argument, as "state.q[3] is nan, expected a finite number", unless every
/// field of the message may pass.
template <class Message>
void CheckMessage(const Message& message) {
  Gate().Walk(message);
}

}  // namespace ros_interface
}  // namespace contact_flow
