// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <map>
#include <mutex>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "src/ros/answer/answers.h"
#include "test/fuzz/wire_kind.h"

/// What hostile_test sends and what it counts.
namespace contact_flow {
namespace fuzz {

inline double Since(ros::WallTime begin) { return (ros::WallTime::now() - begin).toSec(); }

/// Does `text` have this name as a word?
inline bool HasWord(const std::string& text, const std::string& name) {
  const auto in_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  for (std::size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if ((at == 0 || !in_word(text[at - 1])) && (end == text.size() || !in_word(text[end]))) {
      return true;
    }
  }
  return false;
}
inline bool HasAnyWord(const std::string& text, const std::vector<std::string>& names) {
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& name) { return HasWord(text, name); });
}
/// "q" of "state.q".
inline std::string LastPart(const std::string& path) { return path.substr(path.rfind('.') + 1); }

/// Why a request that is in order in all its fields may be refused: by what the node does, what its
/// model is, or where the simulation stands.
inline bool IsOfTheNode(const std::string& refusal) {
  for (const char* reason :
       {"busy: ", "out of memory", "the simulation is running", "steps are being taken already",
        "the run has come to its end", "the node is shutting down", "has no inputs",
        "Assumptions 2 to 4 are for contacts without", "no contact forces exist",
        "no impulses of the contacts", "with friction that is not followed"}) {
    if (refusal.find(reason) != std::string::npos) return true;
  }
  return false;
}

/// What is shared by those who send.
class Siege {
 public:
  /// An answer may take `longest` [s].
  Siege(const std::string& model, double longest)
      : longest_(longest), seeds_(model), kinds_(WireKinds()) {
    for (const WireKind& kind : kinds_) total_weight_ += kind.weight;
    ContactTrajectory good = ros_if::Answer(seeds_.setup, seeds_.good);
    expected_ = Unstamped(&good);
  }
  const RequestSeeds& seeds() const { return seeds_; }
  const std::vector<WireKind>& kinds() const { return kinds_; }
  const WireKind& AnyKind(std::mt19937* dice) const {
    std::size_t at = (*dice)() % total_weight_;
    for (const WireKind& kind : kinds_) {
      if (at < kind.weight) return kind;
      at -= kind.weight;
    }
    return kinds_.front();
  }

  void Begin(unsigned long seed, long requests) {
    next_ = first_ = seed;
    end_ = seed + static_cast<unsigned long>(requests);
  }
  /// The number of the next request; false: that was all.
  bool Take(unsigned long* number) {
    *number = next_++;
    if (*number < end_ && !broken_) return true;
    next_ = end_.load();
    return false;
  }
  bool Over() const { return next_ >= end_ && waiting_ == 0 && pursued_; }

  /// Brackets what is waited for, so that what hangs is told.
  void Ask(const std::string& what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    asked_[std::this_thread::get_id()] = {ros::WallTime::now(), what};
    waiting_ = static_cast<int>(asked_.size());
  }
  /// Returns how long it took [s].
  double Answered() {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto it = asked_.find(std::this_thread::get_id());
    const double took = Since(it->second.first);
    if (took > slowest_) {
      slowest_ = took;
      slowest_what_ = it->second.second;
    }
    if (took > longest_) AddWrong(it->second.second + " took " + std::to_string(took) + " s");
    asked_.erase(it);
    waiting_ = static_cast<int>(asked_.size());
    return took;
  }
  std::string Hanging(double seconds) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& entry : asked_) {
      if (Since(entry.second.first) > seconds) return entry.second.second;
    }
    return "";
  }

  void Judge(const WireKind& kind, const HostileRequest& request, bool success,
             const std::string& message, const std::string& what) {
    if (success) {
      ++answered_;
      return;
    }
    ++refused_;
    if (IsOfTheNode(message)) {
      ++by_node_;
      return;
    }
    std::vector<std::string> changed;
    for (const std::string& path : request.changed) changed.push_back(LastPart(path));
    if (HasAnyWord(message, changed)) ++named_;
    // Parameters, coordinates and contacts are told by their names in the model, too.
    const bool by_name =
        std::any_of(seeds_.words.begin(), seeds_.words.end(), [&](const std::string& name) {
          return message.find("'" + name + "'") != std::string::npos;
        });
    if (by_name || HasAnyWord(message, kind.fields)) return;
    AddWrongLocked(what + " is refused without a field: " + message);
  }
  void JudgeGood(ContactTrajectory* told) {
    ++good_;
    if (Unstamped(told) != expected_) AddWrongLocked("a good request has other bits");
  }
  void AddWrongLocked(const std::string& what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    AddWrong(what);
  }
  std::string Wrong() {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::string all;
    for (const std::string& what : wrong_) all += what.substr(0, 1500) + "\n";
    return all;
  }
  std::string Count() {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::ostringstream text;
    text << std::min<unsigned long>(next_, end_) - first_ << " hostile: " << answered_
         << " answered, " << refused_ << " refused (" << by_node_ << " by what the node does, "
         << named_ << " by a field that was changed), " << failed_ << " not understood, "
         << messages_ << " messages, " << settings_ << " settings, " << recordings_
         << " recordings, " << goals_ << " goals; " << good_ << " good ones in between; "
         << dropped_ << " dropped connections; the slowest " << slowest_ << " s: " << slowest_what_;
    return text.str();
  }
  long good() const { return good_; }

  /// Goals have been pursued while there were requests.
  void Pursued() { pursued_ = true; }
  bool Requesting() const { return next_ < end_; }

  std::atomic<long> failed_{0}, messages_{0}, settings_{0}, recordings_{0}, goals_{0}, dropped_{0};

 private:
  static ros_if::Bytes Unstamped(ContactTrajectory* result) {
    result->header = std_msgs::Header();
    return ros_if::Serialize(*result);
  }
  void AddWrong(const std::string& what) {
    wrong_.push_back(what);
    if (wrong_.size() >= 20) broken_ = true;
  }

  const double longest_;  // [s]
  const RequestSeeds seeds_;
  const std::vector<WireKind> kinds_;
  unsigned total_weight_ = 0;
  ros_if::Bytes expected_;
  std::atomic<unsigned long> next_{0}, end_{0};
  unsigned long first_ = 0;
  std::atomic<bool> broken_{false}, pursued_{false};
  std::atomic<int> waiting_{0};
  std::atomic<long> answered_{0}, refused_{0}, named_{0}, by_node_{0}, good_{0};
  std::mutex mutex_;
  std::map<std::thread::id, std::pair<ros::WallTime, std::string>> asked_;
  double slowest_ = 0;
  std::string slowest_what_;
  std::vector<std::string> wrong_;
};

}  // namespace fuzz
}  // namespace contact_flow
