// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "src/ros/recording/bag_file.h"
#include "src/ros/recording/chained_bag.h"

namespace contact_flow {
namespace ros_interface {

/// Writes a stream of messages to bags from a thread of its own, so that the disk delays nobody.
/// Every message is a chunk of its own, written at once: of a process that is killed only the last
/// message written may be lost, verify_bag reads the others, and `rosbag reindex` makes a bag of
/// them that can be played. A bag that has grown beyond split_size is followed by NAME_1.bag,
/// NAME_2.bag, …, each of which begins with the preamble again. May be used by several threads.
class StreamRecorder {
 public:
  static constexpr std::size_t kUsualSplitSize = std::size_t{128} << 20;  ///< [bytes]
  /// Messages that may wait for the disk; more end the recording.
  static constexpr std::size_t kMaxWaiting = 200000;
  /// A link follows so many messages, or the first after so long [s].
  static constexpr std::uint32_t kMessagesPerLink = 256;
  static constexpr double kLinkPeriod = 0.1;

  explicit StreamRecorder(std::string directory, std::size_t split_size = kUsualSplitSize)
      : directory_(std::move(directory)), split_size_(split_size) {}
  /// Writes what waits, and closes.
  ~StreamRecorder();

  bool Recording() const;
  /// Begins NAME.bag, or throws as Recorder::Start; returns its path.
  std::string Start(const std::string& name, const RecordingPlan& plan, const ros::Time& stamp);
  /// The entry is on its way to the file; does nothing when not recording.
  void Write(const ros::Time& stamp, BagEntry entry);
  /// Takes no more messages; the first half of Stop, which waits for nobody. Throws
  /// std::invalid_argument when not recording.
  void Close();
  /// Writes what waits, and returns the paths; after Close, by any thread. Until it is done no
  /// other recording begins. Throws std::runtime_error when not everything was written.
  std::vector<std::string> Finish();
  std::vector<std::string> Stop() {
    Close();
    return Finish();
  }
  /// Why the recording has ended by itself, and what is not recorded, or "".
  std::string Error() const;

 private:
  void Run();
  void Put(const ros::Time& stamp, const BagEntry& entry);
  void BeginPart(const std::string& path, const ros::Time& stamp);
  void NextPart();
  void ClosePart(std::uint8_t state);
  void Fail(const std::string& why);
  void End();

  const std::string directory_;
  const std::size_t split_size_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::thread thread_;
  bool recording_ = false;
  bool stopping_ = false;
  bool closing_ = false;  // between Close and the end of Finish
  std::string error_;
  ros::Time lost_since_;
  std::uint64_t lost_ = 0;  // messages that came after the error
  std::vector<std::string> paths_;
  std::deque<std::pair<ros::Time, BagEntry>> waiting_;
  // The writing thread's:
  std::optional<ChainedBag> bag_;
  std::unique_ptr<NewFile> file_;
  std::chrono::steady_clock::time_point last_link_;
};

}  // namespace ros_interface
}  // namespace contact_flow
