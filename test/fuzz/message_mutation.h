// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "src/ros/message/gate.h"

namespace contact_flow {
namespace fuzz {

/// Changes messages of any type as hostile clients do: a few of their fields, chosen at random, get
/// numbers at and beyond every limit, other sizes, other names, other times. What comes out depends
/// on the generator alone.
class MessageMutator {
 public:
  /// `words`: names that mean something to whoever reads the message.
  MessageMutator(std::mt19937* generator, std::vector<std::string> words)
      : generator_(*generator), words_(std::move(words)) {}

  template <class Message>
  void Mutate(Message* message) {
    changed_.clear();
    for (std::size_t changes = 1 + Below(4); changes > 0; --changes) {
      target_ = std::numeric_limits<std::size_t>::max();
      count_ = 0;
      Walk(*message);
      if (count_ == 0) return;
      target_ = Below(count_);
      count_ = 0;
      Walk(*message);
    }
  }

  std::size_t Below(std::size_t n) { return n == 0 ? 0 : generator_() % n; }
  /// The fields that were changed last, as "state.q".
  const std::vector<std::string>& changed() const { return changed_; }

  double Number(double was) {
    constexpr double kInf = std::numeric_limits<double>::infinity();
    static const double kNumbers[] = {std::nan(""), kInf,   -kInf,  5e-324, -5e-324,
                                      1e-310,       1e-200, 1e-100, 1e-12,  1e-9,
                                      1e-6,         1e-3,   0,      -0.0,   1,
                                      -1,           2,      10,     1e3,    1e5,
                                      1e6,          1e9,    4e9,    1e12,   1e15,
                                      1e18,         1e30,   1e99,   1e100,  1e101,
                                      1e200,        1e308,  -1e308, 1e-99,  1.7976931348623157e308};
    constexpr std::size_t kCount = sizeof(kNumbers) / sizeof(kNumbers[0]);
    switch (Below(8)) {
      case 0:
        return -was;
      case 1:
        return was * (1 + 1e-9);
      case 2:
        return was * 10;
      case 3:
        return was + 1e-3;
      default:
        return kNumbers[Below(kCount)];
    }
  }

  std::string Text() {
    switch (Below(12)) {
      case 0:
        return "";
      case 1:
        return std::string(5000, 'x');
      case 2:
        return "%s%n%x";
      case 3:
        return std::string("a\0b\xff\xc3", 5);
      case 4:
        return "-" + Word();
      case 5:
        return "+d/dt " + Word();
      case 6:
        return "d/dt " + Word();
      case 7: {
        std::string word = Word();
        if (!word.empty()) word[Below(word.size())] = '_';
        return word;
      }
      default:
        return Word();
    }
  }

  /// For the serializer of messages.
  template <class Field>
  void next(Field& field) {
    const std::string* const outer = field_;
    field_ = &names_->at(index_++);
    Visit(field);
    field_ = outer;
  }

 private:
  std::string Word() { return words_.empty() ? "" : words_[Below(words_.size())]; }
  bool Chosen() {
    if (count_++ != target_) return false;
    std::string path;
    for (const std::string* name : path_) path += *name + ".";
    changed_.push_back(path + *field_);
    return true;
  }

  template <class Message>
  void Walk(Message& message) {
    static const std::vector<std::string> names =
        ros_interface::FieldNames(ros::message_traits::Definition<Message>::value());
    const std::vector<std::string>* const outer = names_;
    const std::size_t index = index_;
    if (field_ != nullptr) path_.push_back(field_);
    names_ = &names;
    index_ = 0;
    ros::serialization::Serializer<Message>::template allInOne<MessageMutator, Message&>(*this,
                                                                                         message);
    names_ = outer;
    index_ = index;
    if (field_ != nullptr) path_.pop_back();
  }

  /// [s]: now, the beginning, in a moment, the last of all, and long past.
  std::int64_t Seconds() {
    static const std::int64_t kSeconds[] = {0, 1, 100, 4000000000, 4294967295, 2147483647};
    return kSeconds[Below(sizeof(kSeconds) / sizeof(kSeconds[0]))];
  }
  void Visit(ros::Time& time) {
    if (!Chosen()) return;
    time.sec = static_cast<std::uint32_t>(Seconds());
    time.nsec = Below(2) == 0 ? 0 : 999999999;
  }
  void Visit(ros::Duration& duration) {
    if (!Chosen()) return;
    duration.sec = static_cast<std::int32_t>(Seconds());
    duration.nsec = Below(2) == 0 ? 1 : -1;
  }
  void Visit(std::string& text) {
    if (Chosen()) text = Text();
  }
  template <class Entry, class Allocator>
  void Visit(std::vector<Entry, Allocator>& entries) {
    if (Chosen()) return Change(entries);
    if constexpr (!std::is_arithmetic_v<Entry> && !std::is_same_v<Entry, std::string>) {
      for (Entry& entry : entries) Walk(entry);
    }
  }
  template <class Field>
  void Visit(Field& field) {
    if constexpr (std::is_floating_point_v<Field>) {
      if (Chosen()) field = static_cast<Field>(Number(field));
    } else if constexpr (std::is_integral_v<Field>) {
      if (Chosen()) field = Whole(field);
    } else {
      Walk(field);
    }
  }

  template <class Integer>
  Integer Whole(Integer was) {
    using Limits = std::numeric_limits<Integer>;
    const Integer numbers[] = {0,
                               1,
                               2,
                               3,
                               10,
                               Limits::max(),
                               Limits::min(),
                               static_cast<Integer>(Limits::max() / 2),
                               static_cast<Integer>(static_cast<std::uint64_t>(was) + 1),
                               static_cast<Integer>(static_cast<std::uint64_t>(was) - 1),
                               static_cast<Integer>(-1),
                               static_cast<Integer>(1000)};
    return numbers[Below(sizeof(numbers) / sizeof(numbers[0]))];
  }

  template <class Entry>
  Entry NewEntry(const Entry& like) {
    if constexpr (std::is_floating_point_v<Entry>) {
      return Number(like);
    } else if constexpr (std::is_integral_v<Entry>) {
      return Whole(like);
    } else if constexpr (std::is_same_v<Entry, std::string>) {
      return Text();
    } else {
      return like;
    }
  }

  template <class Entries>
  void Change(Entries& entries) {
    using Entry = typename Entries::value_type;
    const Entry like = entries.empty() ? Entry() : entries[Below(entries.size())];
    switch (Below(7)) {
      case 0:
        entries.clear();
        break;
      case 1:
        entries.push_back(NewEntry(like));
        break;
      case 2:
        if (!entries.empty()) entries.erase(entries.begin() + Below(entries.size()));
        break;
      case 3:
        entries.resize(Below(16), like);
        break;
      case 4:
        if (std::is_arithmetic_v<Entry> && Below(20) == 0) entries.resize(Below(100000), like);
        break;
      case 5:
        entries.insert(entries.begin() + Below(entries.size() + 1), like);
        break;
      default:
        if (!entries.empty()) entries[Below(entries.size())] = NewEntry(like);
    }
  }

  std::mt19937& generator_;
  const std::vector<std::string> words_;
  std::size_t count_ = 0, target_ = 0;
  const std::vector<std::string>* names_ = nullptr;  // of the message that is walked
  std::size_t index_ = 0;                            // of the next of them
  const std::string* field_ = nullptr;               // that is visited
  std::vector<const std::string*> path_;             // of the messages around it
  std::vector<std::string> changed_;
};

/// Looks for a NaN in an answer, but in those fields where it has a meaning, as ".radii".
class NanFinder {
 public:
  explicit NanFinder(std::vector<std::string> meant = {}) : meant_(std::move(meant)) {}
  /// The path of the first, or "".
  template <class Message>
  std::string In(const Message& message) {
    Walk(message);
    return found_;
  }
  template <class Field>
  void next(const Field& field) {
    const std::size_t length = path_.size();
    path_ += "." + names_->at(index_++);
    Visit(field);
    path_.resize(length);
  }

 private:
  template <class Message>
  void Walk(const Message& message) {
    static const std::vector<std::string> names =
        ros_interface::FieldNames(ros::message_traits::Definition<Message>::value());
    const std::vector<std::string>* const outer = names_;
    const std::size_t index = index_;
    names_ = &names;
    index_ = 0;
    ros::serialization::Serializer<Message>::template allInOne<NanFinder, const Message&>(*this,
                                                                                          message);
    names_ = outer;
    index_ = index;
  }
  void Visit(const std::string&) {}
  void Visit(const ros::Time&) {}
  void Visit(const ros::Duration&) {}
  template <class Entry, class Allocator>
  void Visit(const std::vector<Entry, Allocator>& entries) {
    for (const Entry& entry : entries) Visit(entry);
  }
  template <class Field>
  void Visit(const Field& field) {
    if constexpr (std::is_floating_point_v<Field>) {
      const bool meant = std::find(meant_.begin(), meant_.end(), path_) != meant_.end();
      if (std::isnan(field) && found_.empty() && !meant) found_ = path_;
    } else if constexpr (!std::is_arithmetic_v<Field>) {
      Walk(field);
    }
  }

  const std::vector<std::string> meant_;
  const std::vector<std::string>* names_ = nullptr;
  std::size_t index_ = 0;
  std::string path_, found_;
};

}  // namespace fuzz
}  // namespace contact_flow
