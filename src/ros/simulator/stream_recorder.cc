// SPDX-License-Identifier: BSD-3-Clause
#include "stream_recorder.h"

#include <unistd.h>

#include <stdexcept>
#include <utility>

#include "src/ros/recording/recorder.h"

namespace contact_flow {
namespace ros_interface {

StreamRecorder::~StreamRecorder() { End(); }

bool StreamRecorder::Recording() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return recording_;
}

std::string StreamRecorder::Error() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (error_.empty() || lost_ == 0) return error_;
  return error_ + "; " + std::to_string(lost_) + " messages from stamp " +
         std::to_string(lost_since_.toSec()) + " s on are NOT RECORDED";
}

std::string StreamRecorder::Start(const std::string& asked, const RecordingPlan& plan,
                                  const ros::Time& stamp) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (recording_) throw std::invalid_argument("already recording to " + paths_.back());
    if (closing_) {
      throw std::invalid_argument(paths_.back() + " is still being written: ask again later");
    }
  }
  End();  // what has ended by itself
  const std::string path = NewBagPath(directory_, asked);
  bag_.emplace(plan);
  BeginPart(path, stamp);
  last_link_ = std::chrono::steady_clock::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  paths_ = {path};
  error_.clear();
  lost_ = 0;
  stopping_ = false;
  recording_ = true;
  thread_ = std::thread([this] { Run(); });
  return path;
}

void StreamRecorder::Write(const ros::Time& stamp, BagEntry entry) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!recording_) {
      if (error_.empty()) return;
      if (lost_++ == 0) lost_since_ = stamp;
      return;
    }
    if (waiting_.size() >= kMaxWaiting) {
      error_ = paths_.back() + ": the disk does not keep up, " + std::to_string(kMaxWaiting) +
               " messages wait; the recording ends here";
      recording_ = false;
      stopping_ = true;
      lost_ = 1;
      lost_since_ = stamp;
    } else {
      waiting_.emplace_back(stamp, std::move(entry));
    }
  }
  changed_.notify_one();
}

void StreamRecorder::Put(const ros::Time& stamp, const BagEntry& entry) {
  file_->Append(bag_->Add(entry, stamp));
  const auto now = std::chrono::steady_clock::now();
  const double since = std::chrono::duration<double>(now - last_link_).count();
  if (bag_->unlinked() < kMessagesPerLink && since < kLinkPeriod) return;
  file_->Append(bag_->Link(RecordingLink::GOES_ON));
  last_link_ = now;
}

void StreamRecorder::ClosePart(std::uint8_t state) {
  if (!file_) return;
  file_->Append(bag_->Link(state));
  file_->Append(bag_->End());
  file_->Overwrite(0, bag_->Head());
  file_->Close();
  file_.reset();
}

void StreamRecorder::BeginPart(const std::string& path, const ros::Time& stamp) {
  file_ = std::make_unique<NewFile>(path);
  try {
    file_->Append(bag_->Begin(stamp));
    file_->Append(bag_->Link(RecordingLink::GOES_ON));
  } catch (...) {
    file_.reset();
    ::unlink(path.c_str());  // there is nothing in it
    throw;
  }
}

void StreamRecorder::NextPart() {
  ClosePart(RecordingLink::PART_ENDS);
  const std::string path = NextPartPath(paths_.front(), paths_.size());
  BeginPart(path, ros::Time());
  const std::lock_guard<std::mutex> lock(mutex_);
  paths_.push_back(path);
}

/// The bag keeps what it holds; what waits is lost, and counted.
void StreamRecorder::Fail(const std::string& why) {
  file_.reset();
  const std::lock_guard<std::mutex> lock(mutex_);
  error_ = why + "; the recording ends here";
  recording_ = false;
  lost_ += waiting_.size();
  if (!waiting_.empty()) lost_since_ = waiting_.front().first;
  waiting_.clear();
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
      while (!batch.empty()) {
        Put(batch.front().first, batch.front().second);
        batch.pop_front();
        if (bag_->size() >= split_size_) NextPart();
      }
    } catch (const std::exception& error) {  // the disk is full, or gone
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        waiting_.insert(waiting_.begin(), batch.begin(), batch.end());
      }
      return Fail(error.what());
    }
  }
}

/// The writing thread comes to its end, and the file.
void StreamRecorder::End() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    recording_ = false;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  try {
    ClosePart(RecordingLink::RECORDING_ENDS);
  } catch (const std::exception& error) {
    Fail(error.what());
  }
}

void StreamRecorder::Close() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closing_ || (!recording_ && error_.empty())) throw std::invalid_argument("not recording");
    closing_ = stopping_ = true;
    recording_ = false;
  }
  changed_.notify_one();
}

std::vector<std::string> StreamRecorder::Finish() {
  End();
  const std::string error = Error();
  const std::lock_guard<std::mutex> lock(mutex_);
  closing_ = false;
  error_.clear();
  if (!error.empty()) throw std::runtime_error(error);
  return paths_;
}

}  // namespace ros_interface
}  // namespace contact_flow
