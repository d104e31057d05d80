// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "contact_flow/ros/bag_file.h"

namespace contact_flow {
namespace ros_interface {

/// Writes a stream of messages to bags from a thread of its own, so that the disk delays nobody.
/// Every message is a chunk of its own: of a process that is killed only the last message written
/// may be lost, and `rosbag reindex` finds the others. A bag that has grown beyond split_size is
/// followed by NAME_1.bag, NAME_2.bag, …, each of which begins with the preamble again. May be used
/// by several threads.
class StreamRecorder {
 public:
  static constexpr std::size_t kUsualSplitSize = std::size_t{128} << 20;  ///< [bytes]
  /// Messages that may wait for the disk; more end the recording.
  static constexpr std::size_t kMaxWaiting = 200000;

  explicit StreamRecorder(std::string directory, std::size_t split_size = kUsualSplitSize)
      : directory_(std::move(directory)), split_size_(split_size) {}
  /// Writes what waits, and closes.
  ~StreamRecorder();

  bool Recording() const;
  /// What every bag begins with, as of a time.
  using Preamble = std::function<BagEntry(const ros::Time& time)>;

  /// Begins NAME.bag, or throws as Recorder::Start; returns its path.
  std::string Start(const std::string& name, const Preamble& preamble, const ros::Time& time);
  /// The entry is on its way to the file; does nothing when not recording.
  void Write(const ros::Time& time, BagEntry entry);
  /// Writes what waits, closes, and returns the paths. Throws std::invalid_argument when not
  /// recording, std::runtime_error when not everything was written.
  std::vector<std::string> Stop();
  /// Why the recording has ended by itself, or "".
  std::string Error() const;

 private:
  void Run();
  void Open(const std::string& path, const ros::Time& time);
  void Close();
  void Finish();

  const std::string directory_;
  const std::size_t split_size_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::thread thread_;
  bool recording_ = false;
  bool stopping_ = false;
  std::string error_;
  std::string name_;
  std::vector<std::string> paths_;
  std::deque<std::pair<ros::Time, BagEntry>> waiting_;
  Preamble preamble_;
  std::unique_ptr<rosbag::Bag> bag_;  // the writing thread's
};

}  // namespace ros_interface
}  // namespace contact_flow
