// SPDX-License-Identifier: BSD-3-Clause
#include "src/ros/service/work_threads.h"

#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <sys/resource.h>  // getpriority
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

namespace contact_flow {
namespace ros_interface {
namespace {

/// Of this thread.
int Niceness() { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid))); }

class Callback : public ros::CallbackInterface {
 public:
  explicit Callback(std::function<void()> body) : body_(std::move(body)) {}
  CallResult call() override {
    body_();
    return Success;
  }

 private:
  const std::function<void()> body_;
};

/// Also run without privileges, where a thread may not come back and is replaced:
/// setpriv --reuid 65534 --clear-groups build/devel/lib/contact_flow/ros_test
TEST(WorkThreads, NoneBeginsBehindOthers) {
  const int before = Niceness();
  ros::CallbackQueue queue;
  std::atomic<int> done{0}, behind{0}, back{0};
  const int kCalls = 30;
  {
    const WorkThreads threads(3, &queue);
    for (int k = 0; k < kCalls; ++k) {
      queue.addCallback(ros::CallbackInterfacePtr(new Callback([&] {
        behind += Niceness() != before;
        StepBack();
        StepBack();  // once is enough
        back += Niceness() == before + 10 || Niceness() == 19;
        ++done;
      })));
    }
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (done < kCalls && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  EXPECT_EQ(done, kCalls);
  EXPECT_EQ(back, kCalls);
  EXPECT_EQ(behind, 0);
  EXPECT_EQ(Niceness(), before);
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
