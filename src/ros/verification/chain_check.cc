// SPDX-License-Identifier: BSD-3-Clause
#include "chain_check.h"

#include <algorithm>

#include "src/ros/recording/deserialize.h"

namespace contact_flow {
namespace ros_interface {
namespace {

Digest ToDigest(const boost::array<std::uint8_t, 32>& bytes) {
  Digest digest;
  std::copy(bytes.begin(), bytes.end(), digest.begin());
  return digest;
}

std::string Range(std::uint64_t first, std::uint64_t count) {
  return count == 0
             ? "no messages"
             : "messages " + std::to_string(first) + " to " + std::to_string(first + count - 1);
}

}  // namespace

ChainCheck::Report ChainCheck::Take(const BagContent& bag) {
  Report report;
  report.sound = bag.messages.size();
  std::map<BagConnection, Digest> hashes;
  hash_ = LinkHash();
  rewritten_ = false;
  link_begin_ = 0;
  bool ended = false;
  const bool missing_before = missing_;
  if (bag.messages.empty() || !Is<RecordingStart>(bag.messages.front())) {
    report.gaps.push_back("the bag does not begin with the start of a recording");
    report.sound = 0;
    missing_ = true;
    last_.reset();
    index_known_ = false;
    state_ = RecordingLink::RECORDING_ENDS;
    recording_.clear();
  }
  for (std::size_t i = 0; i < bag.messages.size(); ++i) {
    const BagMessage& message = bag.messages[i];
    if (ended) report.differences.push_back("messages follow the end of the recording");
    ended = false;
    if (Is<RecordingStart>(message)) Take(Deserialize<RecordingStart>(message), i == 0, &report);
    if (!(message.time > time_)) {
      report.differences.push_back("message " + std::to_string(i + 1) +
                                   " of the bag is not later than the one before");
    }
    time_ = message.time;
    if (Is<RecordingLink>(message)) {
      Take(Deserialize<RecordingLink>(message), i, &report);
      ended = state_ != RecordingLink::GOES_ON;
      continue;
    }
    const auto [hash, is_new] = hashes.emplace(message.connection, Digest());
    if (is_new) hash->second = HashOf(*message.connection);
    rewritten_ = rewritten_ || !message.connection->count("callerid");
    hash_.Add(hash->second, message.time, message.data, message.size);
  }
  if (report.goes_on && missing_before) report.sound = 0;
  if (hash_.count() > 0) {
    report.gaps.push_back("the last " + std::to_string(hash_.count()) +
                          " messages are in no link of the chain");
    missing_ = true;
  }
  if (!bag.closed) {
    report.gaps.push_back(
        "the bag was never closed" +
        (bag.cut_at > 0 ? ", and breaks off in the record at byte " + std::to_string(bag.cut_at)
                        : ""));
  }
  return report;
}

void ChainCheck::Take(const RecordingStart& start, bool first_message, Report* report) {
  if (!first_message) {
    report->differences.push_back("a recording starts in the middle of a bag");
    return;
  }
  const std::string unfinished = End();
  const bool same = !recording_.empty() && start.recording == recording_;
  report->goes_on = same && state_ == RecordingLink::PART_ENDS && start.part == parts_ &&
                    start.messages + 1 == next_message_ && last_ &&
                    ToDigest(start.previous) == *last_;
  if (report->goes_on) {
    ++parts_;
    return;
  }
  if (!unfinished.empty()) report->gaps.push_back("of the recording before: " + unfinished);
  const Digest zero{};
  if (start.part == 0 && (start.messages != 0 || ToDigest(start.previous) != zero)) {
    report->differences.push_back("part 0 claims that something was recorded before it");
  }
  missing_ = start.part != 0;
  if (missing_) {
    report->gaps.push_back("part " + std::to_string(start.part) +
                           " of a recording, whose part before is not given before it");
    report->sound = 0;
  }
  recording_ = start.recording;
  parts_ = start.part + 1;
  next_message_ = start.messages + 1;
  last_ = ToDigest(start.previous);
  next_index_ = 1;
  index_known_ = start.part == 0;
  state_ = RecordingLink::GOES_ON;
  time_ = ros::Time();
}

void ChainCheck::Take(const RecordingLink& link, std::size_t message, Report* report) {
  const std::uint32_t present = hash_.count();
  const Digest digest = hash_.Take(link);
  const std::string covers = Range(link.first, link.count);
  const auto differ = [&](const std::string& how) {
    report->differences.push_back("link " + std::to_string(link.index) + ": " + how);
  };
  const auto gap = [&](const std::string& what) {
    report->gaps.push_back("link " + std::to_string(link.index) + ": " + what);
    report->sound = std::min(report->sound, link_begin_);
    missing_ = true;
  };
  if (!recording_.empty() && link.recording != recording_) differ("of another recording");
  recording_ = link.recording;
  if (!index_known_) {
    next_index_ = link.index;
    index_known_ = true;
  }
  const bool jumps = link.index > next_index_ || !last_;
  if (link.index < next_index_) differ("out of order");
  if (jumps) {
    gap("links before it are missing");
  } else if (ToDigest(link.previous) != *last_ || link.first != next_message_) {
    differ("does not follow from the link before");
  }
  if (present < link.count) {
    gap(std::to_string(link.count - present) + " of " + covers + " are missing");
  } else if (present > link.count && !jumps) {
    differ(std::to_string(present - link.count) + " messages more than were recorded");
  } else if (present == link.count && digest != ToDigest(link.digest)) {
    if (rewritten_) {
      report->gaps.push_back("link " + std::to_string(link.index) +
                             ": the bag was rewritten without the names of who sent what");
    } else {
      differ(covers + " are not those that were recorded (SHA-256)");
    }
  } else if (present == link.count) {
    ++links_;
  }
  if (key_) {
    if (link.signature.empty()) {
      report->gaps.push_back("link " + std::to_string(link.index) + " is not signed");
    } else if (!key_->Verifies(ToDigest(link.digest), link.signature)) {
      differ("the signature is not of this key");
    } else {
      ++signed_;
    }
  }
  last_ = ToDigest(link.digest);
  next_index_ = link.index + 1;
  next_message_ = link.first + link.count;
  state_ = link.state;
  rewritten_ = false;
  link_begin_ = message + 1;
}

std::string ChainCheck::End() const {
  if (state_ == RecordingLink::PART_ENDS) {
    return "it goes on in part " + std::to_string(parts_) + ", which is not here";
  }
  if (state_ == RecordingLink::GOES_ON) {
    return "it was not ended: it is still going on, or its node was killed, or its end cut off";
  }
  return "";
}

}  // namespace ros_interface
}  // namespace contact_flow
