// SPDX-License-Identifier: BSD-3-Clause
// The records that a bag consists of, read one by one: for bag_reader.cc.
#pragma once

#include <ros/time.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "bag_reader.h"

namespace contact_flow {
namespace ros_interface {
namespace bag_records {

/// Breaks off in the middle: at the end of a bag that was never closed that is no damage.
struct Broken : DamagedBag {
  using DamagedBag::DamagedBag;
};

/// Bytes from `position` to `end`.
class Cursor {
 public:
  Cursor(const std::string& bytes, std::size_t position, std::size_t end)
      : bytes_(bytes), position_(position), end_(end) {}

  std::size_t position() const { return position_; }
  bool done() const { return position_ == end_; }
  std::size_t Skip(std::size_t size, const char* what) {
    if (size > end_ - position_) {
      throw Broken(position_, std::string(what) + " of " + std::to_string(size) +
                                  " bytes, of which only " + std::to_string(end_ - position_) +
                                  " are there");
    }
    return std::exchange(position_, position_ + size);
  }
  template <class Number>
  Number Take(const char* what) {
    Number number;
    std::memcpy(&number, bytes_.data() + Skip(sizeof(number), what), sizeof(number));
    return number;
  }
  /// What is as long as the number before it says.
  Cursor Part(const char* what) {
    const auto size = Take<std::uint32_t>("a length");
    const std::size_t begin = Skip(size, what);
    return Cursor(bytes_, begin, begin + size);
  }
  std::string Rest() { return bytes_.substr(position_, end_ - position_); }
  std::size_t size() const { return end_ - position_; }
  const char* data() const { return bytes_.data() + position_; }

 private:
  const std::string& bytes_;
  std::size_t position_;
  std::size_t end_;
};

inline BagFields Fields(Cursor cursor) {
  BagFields fields;
  while (!cursor.done()) {
    const std::size_t at = cursor.position();
    const std::string text = cursor.Part("a field").Rest();
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) throw DamagedBag(at, "a field without '='");
    const std::string name = text.substr(0, equals);
    if (!fields.emplace(name, text.substr(equals + 1)).second) {
      throw DamagedBag(at, "a field that is there twice");
    }
  }
  return fields;
}

/// A record of a bag: header and data.
struct Record {
  std::size_t position;
  BagOp op;
  BagFields header;
  Cursor data;

  template <class Number>
  Number Get(const char* name) const {
    const std::string& text = header.at(name);
    Number number{};
    if (text.size() != sizeof(number)) throw DamagedBag(position, std::string(name) + " is cut");
    std::memcpy(&number, text.data(), sizeof(number));
    return number;
  }
  ros::Time Time(const char* name) const { return TimeOf(Get<std::uint64_t>(name)); }
  ros::Time TimeOf(std::uint64_t bits) const {
    const std::uint64_t nanoseconds = bits >> 32;
    if (nanoseconds >= 1000000000) throw DamagedBag(position, "a time with 1e9 ns or more");
    ros::Time time;
    time.sec = static_cast<std::uint32_t>(bits);
    time.nsec = static_cast<std::uint32_t>(nanoseconds);
    return time;
  }
};

/// The fields that a header has, all of them and no others.
inline const std::set<std::string>& Expected(BagOp op, std::size_t position) {
  static const std::map<BagOp, std::set<std::string>> kFields = {
      {BagOp::kMessage, {"op", "conn", "time"}},
      {BagOp::kFileHeader, {"op", "index_pos", "conn_count", "chunk_count"}},
      {BagOp::kIndexData, {"op", "ver", "conn", "count"}},
      {BagOp::kChunk, {"op", "compression", "size"}},
      {BagOp::kChunkInfo, {"op", "ver", "chunk_pos", "start_time", "end_time", "count"}},
      {BagOp::kConnection, {"op", "conn", "topic"}}};
  const auto found = kFields.find(op);
  if (found == kFields.end()) throw DamagedBag(position, "a record of an unknown kind");
  return found->second;
}

/// The record at the cursor, which moves on.
inline Record Next(Cursor* cursor) {
  const std::size_t position = cursor->position();
  const Cursor header = cursor->Part("a header");
  const Cursor data = cursor->Part("data");
  BagFields fields = Fields(header);
  const auto op = fields.find("op");
  if (op == fields.end() || op->second.size() != 1)
    throw DamagedBag(position, "a header without op");
  Record record{position, static_cast<BagOp>(op->second[0]), std::move(fields), data};
  const std::set<std::string>& expected = Expected(record.op, position);
  const bool same =
      expected.size() == record.header.size() &&
      std::equal(expected.begin(), expected.end(), record.header.begin(),
                 [](const std::string& name, const auto& field) { return name == field.first; });
  if (!same) throw DamagedBag(position, "a header with other fields than it must have");
  const auto version = record.header.find("ver");
  if (version != record.header.end() && record.Get<std::uint32_t>("ver") != 1) {
    throw DamagedBag(position, "an index of another version than 1");
  }
  return record;
}

}  // namespace bag_records
}  // namespace ros_interface
}  // namespace contact_flow
