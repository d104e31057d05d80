// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact_flow/RecordingStart.h"
#include "src/ros/recording/bag_reader.h"
#include "src/ros/recording/record_chain.h"

namespace contact_flow {
namespace ros_interface {

/// Follows the hash chain of recordings through their bags, part by part in order, and tells what
/// is not as it was recorded (differences), and what cannot be said, since something
/// is missing (gaps).
class ChainCheck {
 public:
  /// `key`: whose signature every link must bear, or null.
  explicit ChainCheck(std::shared_ptr<const SigningKey> key) : key_(std::move(key)) {}

  struct Report {
    std::vector<std::string> differences;
    std::vector<std::string> gaps;
    /// Index of the first message of the bag before which something may be missing; without such,
    /// the number of messages.
    std::size_t sound = 0;
    bool goes_on = false;  ///< the bag continues the recording of the bag before
  };
  /// The next bag.
  Report Take(const BagContent& bag);
  /// After the last bag: what is missing of the last recording, or "".
  std::string End() const;
  std::uint64_t links() const { return links_; }          ///< that were found in order
  std::uint64_t signed_links() const { return signed_; }  ///< of these, checked by the key

 private:
  void Take(const RecordingStart& start, bool first_message, Report* report);
  void Take(const RecordingLink& link, std::size_t message, Report* report);

  const std::shared_ptr<const SigningKey> key_;
  std::string recording_;  // "": none has begun
  std::optional<Digest> last_;
  std::uint64_t next_index_ = 1, next_message_ = 1;
  bool index_known_ = true;
  std::uint32_t parts_ = 0;
  std::uint8_t state_ = RecordingLink::RECORDING_ENDS;  // of the last link
  LinkHash hash_;
  bool rewritten_ = false;      // a message of this link has lost fields of its connection
  std::size_t link_begin_ = 0;  // first message of this link, in its bag
  bool missing_ = false;        // something before is missing
  ros::Time time_;
  std::uint64_t links_ = 0, signed_ = 0;
};

}  // namespace ros_interface
}  // namespace contact_flow
