// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/stream_recorder.h"

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "contact_flow/ros/bag_door.h"
#include "contact_flow/ros/recorder.h"

namespace contact_flow {
namespace ros_interface {

StreamRecorder::~StreamRecorder() { Finish(); }

bool StreamRecorder::Recording() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return recording_;
}

std::string StreamRecorder::Error() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return error_;
}

std::string StreamRecorder::Start(const std::string& asked, const Preamble& preamble,
                                  const ros::Time& time) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (recording_) throw std::invalid_argument("already recording to " + paths_.back());
  }
  Finish();  // what has ended by itself
  const std::string path = NewBagPath(directory_, asked);
  paths_ = {path};
  name_ = path.substr(0, path.size() - 4);
  preamble_ = preamble;
  error_.clear();
  Open(path, time);
  stopping_ = false;
  recording_ = true;
  thread_ = std::thread([this] { Run(); });
  return path;
}

void StreamRecorder::Write(const ros::Time& time, BagEntry entry) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!recording_) return;
    if (waiting_.size() >= kMaxWaiting) {
      error_ = paths_.back() + ": the disk does not keep up, " + std::to_string(kMaxWaiting) +
               " messages wait; the recording ends here";
      recording_ = false;
      stopping_ = true;
    } else {
      waiting_.emplace_back(time, std::move(entry));
    }
  }
  changed_.notify_one();
}

void StreamRecorder::Open(const std::string& path, const ros::Time& time) {
  try {
    bag_ = OpenBag(path, rosbag::bagmode::Write);
    bag_->setChunkThreshold(1);
    preamble_(time)(bag_.get());
  } catch (const rosbag::BagException& error) {
    GiveUpBag(std::move(bag_));
    throw std::runtime_error(path + ": " + error.what());
  }
}

void StreamRecorder::Close() {
  try {
    CloseBag(std::move(bag_));
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(paths_.back() + ": " + error.what());
  }
}

void StreamRecorder::Run() {
  std::deque<std::pair<ros::Time, BagEntry>> batch;
  while (true) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait(lock, [&] { return stopping_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      batch.swap(waiting_);
    }
    try {
      for (const auto& [time, entry] : batch) {
        entry(bag_.get());
        if (bag_->getSize() < split_size_) continue;
        Close();
        std::string path;
        std::size_t part = paths_.size();
        do {
          path = name_ + "_" + std::to_string(part++) + ".bag";
        } while (std::filesystem::exists(path));
        {
          const std::lock_guard<std::mutex> lock(mutex_);
          paths_.push_back(path);
        }
        Open(path, time);
      }
    } catch (const std::exception& error) {  // the disk is full, or gone
      GiveUpBag(std::move(bag_));
      const std::lock_guard<std::mutex> lock(mutex_);
      error_ = paths_.back() + ": " + error.what();
      recording_ = false;
      waiting_.clear();
      return;
    }
    batch.clear();
  }
}

void StreamRecorder::Finish() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    recording_ = false;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  try {
    Close();
  } catch (const std::runtime_error& error) {
    const std::lock_guard<std::mutex> lock(mutex_);
    error_ = error.what();
  }
}

std::vector<std::string> StreamRecorder::Stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!recording_ && error_.empty()) throw std::invalid_argument("not recording");
  }
  Finish();
  const std::string error = Error();
  if (!error.empty()) {
    error_.clear();
    throw std::runtime_error(error);
  }
  return paths_;
}

}  // namespace ros_interface
}  // namespace contact_flow
