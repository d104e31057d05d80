// SPDX-License-Identifier: BSD-3-Clause
#include "work_threads.h"

#include <sys/resource.h>  // setpriority
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <optional>

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr int kBack = 10;           // steps of niceness: a tenth of the weight of others
constexpr double kLookEvery = 0.1;  // [s] whether there is an end

/// What this thread had before it stepped back. The system cuts what is beyond 19, so that the way
/// back is no difference.
thread_local std::optional<int> niceness_before;

/// On Linux the niceness is of the thread.
id_t ThisThread() { return static_cast<id_t>(::syscall(SYS_gettid)); }
bool SetNiceness(int niceness) { return ::setpriority(PRIO_PROCESS, ThisThread(), niceness) == 0; }

}  // namespace

void StepBack() {
  if (niceness_before) return;
  errno = 0;
  const int now = ::getpriority(PRIO_PROCESS, ThisThread());
  if (errno == 0 && SetNiceness(now + kBack)) niceness_before = now;
}

bool BackToTheFront() {
  if (niceness_before && SetNiceness(*niceness_before)) niceness_before.reset();
  return !niceness_before;
}

WorkThreads::WorkThreads(std::size_t count, ros::CallbackQueue* queue)
    : queue_(queue), threads_(count) {
  for (std::size_t place = 0; place < count; ++place) {
    threads_[place] = std::thread([this, place] { Answer(place); });
  }
  keeper_ = std::thread([this] { Replace(); });
}

WorkThreads::~WorkThreads() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  keeper_.join();
  for (std::thread& thread : threads_) thread.join();
}

void WorkThreads::Answer(std::size_t place) {
  while (true) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (stopping_) return;
    }
    queue_->callOne(ros::WallDuration(kLookEvery));
    if (BackToTheFront()) continue;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      behind_.push_back(place);
    }
    changed_.notify_all();
    return;
  }
}

void WorkThreads::Replace() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return stopping_ || !behind_.empty(); });
    if (stopping_) return;
    for (const std::size_t place : behind_) {
      threads_[place].join();  // which is about to end
      threads_[place] = std::thread([this, place] { Answer(place); });
    }
    behind_.clear();
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
