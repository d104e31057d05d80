// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/callback_queue.h>

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <thread>
#include <vector>

namespace contact_flow {
namespace ros_interface {

/// This thread gives way to others of the machine from now on, until BackToTheFront.
void StepBack();
/// False where the system does not allow that: the thread stays behind for good.
bool BackToTheFront();

/// Threads that answer what a queue holds. One that has stepped back in a callback, and may not
/// come back, is replaced by a new one.
class WorkThreads {
 public:
  WorkThreads(std::size_t count, ros::CallbackQueue* queue);
  /// Waits for the callbacks that run.
  ~WorkThreads();
  WorkThreads(const WorkThreads&) = delete;
  WorkThreads& operator=(const WorkThreads&) = delete;

 private:
  void Answer(std::size_t place);
  void Replace();

  ros::CallbackQueue* const queue_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::vector<std::size_t> behind_;  // places whose thread has ended
  std::vector<std::thread> threads_;
  std::thread keeper_;  // begins new ones: a thread inherits how far back its maker is
};

}  // namespace ros_interface
}  // namespace contact_flow
