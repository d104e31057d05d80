// SPDX-License-Identifier: BSD-3-Clause
// A hundred clients of one node: every one is answered, to the same bits, also while recording and
// beside long requests. How soon is printed, and judged where ~limit says so.
#include <gtest/gtest.h>
#include <ros/ros.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "contact_flow/CancelWork.h"
#include "contact_flow/ComputeBDerivative.h"
#include "contact_flow/DescribeModel.h"
#include "contact_flow/GetSimulatorState.h"
#include "contact_flow/SimulateTrajectory.h"
#include "contact_flow/StartRecording.h"
#include "contact_flow/StopRecording.h"

namespace contact_flow {
namespace {

using Clock = std::chrono::steady_clock;

double Since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

template <class Message>
std::string Bytes(const Message& message) {
  std::string bytes(ros::serialization::serializationLength(message), '\0');
  ros::serialization::OStream stream(reinterpret_cast<std::uint8_t*>(&bytes[0]),
                                     static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

std::string Path(const char* service) { return std::string("/crowded/") + service; }

/// So slow that these are long work, which may be refused: "busy".
#if defined(CONTACT_FLOW_SANITIZED) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMayBeBusy = true;
#else
constexpr bool kMayBeBusy = false;
#endif

/// Seconds of the calls of each service, and what was wrong with them.
struct Log {
  std::mutex mutex;
  std::map<std::string, std::vector<double>> seconds;
  std::vector<std::string> wrong;

  void Add(const char* service, double took, const std::string& mistake) {
    const std::lock_guard<std::mutex> lock(mutex);
    seconds[service].push_back(took);
    if (!mistake.empty()) wrong.push_back(std::string(service) + ": " + mistake);
  }
  /// Returns the largest p99 [s].
  double Print(const char* part) {
    double largest = 0;
    for (auto& [service, all] : seconds) {
      std::sort(all.begin(), all.end());
      const auto at = [&, &times = all](double share) {
        return 1e3 * times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
      };
      std::printf("%-20s %-15s %7zu calls, ms: median %8.2f  p99 %8.2f  most %8.2f\n", part,
                  service.c_str(), all.size(), at(0.5), at(0.99), at(1));
      largest = std::max(largest, 1e-3 * at(0.99));
    }
    return largest;
  }
};

class Clients : public testing::Test {
 protected:
  Clients() {
    ros::NodeHandle own("~");
    own.param("seconds", seconds_, 3.0);
    own.param("clients", clients_, 100);
    own.param("rate", rate_, 2.0);
    own.param("limit", limit_, 0.0);
    simulate_.request.samples = 20;
    derivative_.request.directions = {"+body_pitch"};
    for (const char* name : {"simulate", "b_derivative", "get_state", "cancel"}) {
      EXPECT_TRUE(ros::service::waitForService(Path(name), ros::Duration(30)));
    }
    EXPECT_TRUE(ros::service::call(Path("simulate"), simulate_) && simulate_.response.success);
    EXPECT_TRUE(ros::service::call(Path("b_derivative"), derivative_) &&
                derivative_.response.success);
    // What it takes alone and warm: at the best of several, as the machine may be busy.
    for (int k = 0; k < 5; ++k) {
      const Clock::time_point begin = Clock::now();
      EXPECT_TRUE(ros::service::call(Path("b_derivative"), derivative_));
      alone_ = std::min(alone_, Since(begin));
    }
    run_ = Result(simulate_.response.trajectory);
    tangents_ = Result(derivative_.response.derivative);
  }

  /// A result without its stamp.
  template <class Message>
  static std::string Result(Message message) {
    message.header = std_msgs::Header();
    return Bytes(message);
  }

  /// Waits until all are there.
  void Gather() {
    std::unique_lock<std::mutex> lock(gate_);
    if (--coming_ == 0) {
      begin_ = Clock::now();
      open_.notify_all();
    }
    open_.wait(lock, [&] { return coming_ == 0; });
  }

  void Client(int number, Log* log, Log* first) {
    ros::NodeHandle node;
    ros::ServiceClient simulate = node.serviceClient<SimulateTrajectory>(Path("simulate"), true);
    ros::ServiceClient derivative =
        node.serviceClient<ComputeBDerivative>(Path("b_derivative"), true);
    ros::ServiceClient state = node.serviceClient<GetSimulatorState>(Path("get_state"), true);
    ros::ServiceClient describe = node.serviceClient<DescribeModel>(Path("describe_model"), true);
    const double offset = rate_ > 0 ? static_cast<double>(number) / clients_ / rate_ : 0;
    // The first calls make the connections. roscpp lets 100 wait; when more come at once the kernel
    // tries again after a second, which says nothing about the node.
    {
      const Clock::time_point asked = Clock::now();
      SimulateTrajectory run;
      run.request = simulate_.request;
      ComputeBDerivative derived;
      derived.request = derivative_.request;
      GetSimulatorState look;
      DescribeModel model;
      const bool told = simulate.call(run) && derivative.call(derived) && state.call(look) &&
                        describe.call(model);
      first->Add("four first calls", Since(asked), told ? "" : "not answered");
    }
    Gather();
    const Clock::time_point begin = begin_;
    for (int call = 0; Since(begin) < seconds_; ++call) {
      if (rate_ > 0) {
        std::this_thread::sleep_until(begin +
                                      std::chrono::duration_cast<Clock::duration>(
                                          std::chrono::duration<double>(offset + call / rate_)));
      }
      const Clock::time_point asked = Clock::now();
      switch ((call + number) % 4) {
        case 0: {
          SimulateTrajectory run;
          run.request = simulate_.request;
          const bool told = simulate.call(run) && run.response.success;
          const bool same = told && Result(run.response.trajectory) == run_;
          log->Add("simulate", Since(asked), Mistake(told, same, run.response.message));
          break;
        }
        case 1: {
          ComputeBDerivative run;
          run.request = derivative_.request;
          const bool told = derivative.call(run) && run.response.success;
          const bool same = told && Result(run.response.derivative) == tangents_;
          log->Add("b_derivative", Since(asked), Mistake(told, same, run.response.message));
          break;
        }
        case 2: {
          GetSimulatorState look;
          const bool told = state.call(look) && look.response.success;
          log->Add("get_state", Since(asked), Mistake(told, true, look.response.message));
          break;
        }
        default: {
          DescribeModel look;
          const bool told = describe.call(look) && look.response.success;
          log->Add("describe_model", Since(asked), Mistake(told, true, look.response.message));
        }
      }
    }
  }

  static std::string Mistake(bool told, bool same, const std::string& message) {
    if (kMayBeBusy && !told && message.compare(0, 5, "busy:") == 0) return "";
    return !told ? "not answered: " + message : same ? "" : "other bits";
  }

  void Crowd(const char* part) {
    Log log, first;
    std::vector<std::thread> threads;
    coming_ = clients_;
    for (int k = 0; k < clients_; ++k) {
      threads.emplace_back([this, k, &log, &first] { Client(k, &log, &first); });
    }
    for (std::thread& thread : threads) thread.join();
    first.Print(part);
    const double p99 = log.Print(part);
    if (limit_ > 0) {
      EXPECT_LE(p99, limit_) << "the largest p99 [s]";
    }
    EXPECT_EQ(log.seconds.size(), 4u);
    EXPECT_TRUE(first.wrong.empty());
    std::printf("%-20s b_derivative alone takes %.1f ms\n", part, 1e3 * alone_);
    EXPECT_TRUE(log.wrong.empty())
        << log.wrong.size() << " wrong, the first: " << log.wrong.front();
  }

  double seconds_ = 3, rate_ = 2, limit_ = 0, alone_ = 1e9;
  std::mutex gate_;
  std::condition_variable open_;
  int coming_ = 0;
  Clock::time_point begin_;
  int clients_ = 100;
  SimulateTrajectory simulate_;
  ComputeBDerivative derivative_;
  std::string run_, tangents_;
};

TEST_F(Clients, AreAnswered) { Crowd("alone"); }

TEST_F(Clients, AreAnsweredWhileRecording) {
  StartRecording start;
  ASSERT_TRUE(ros::service::call(Path("start_recording"), start));
  ASSERT_TRUE(start.response.success) << start.response.message;
  Crowd("recording");
  StopRecording stop;
  ASSERT_TRUE(ros::service::call(Path("stop_recording"), stop));
  EXPECT_TRUE(stop.response.success) << stop.response.message;
  EXPECT_GT(stop.response.results, 0u) << "beside answers of refused requests, all are recorded";
  for (const std::string& path : stop.response.paths) std::remove(path.c_str());
}

TEST_F(Clients, AreAnsweredBesideLongRequests) {
  std::vector<std::thread> long_ones;
  std::atomic<int> cancelled{0};
  for (int k = 0; k < 4; ++k) {
    long_ones.emplace_back([&cancelled] {
      SimulateTrajectory run;
      run.request.duration = 1e5;
      run.request.samples = 1;
      run.request.options.max_step = 1e-6;
      run.request.options.max_steps = 1000000000;
      run.request.options.max_seconds = 3600;
      const bool told = ros::service::call(Path("simulate"), run) && run.response.success;
      cancelled += told && run.response.outcome == SimulateTrajectory::Response::CANCELLED;
    });
  }
  CancelWork look;
  look.request.ask_only = true;
  for (int k = 0; k < 200 && look.response.running < 4; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ASSERT_TRUE(ros::service::call(Path("cancel"), look));
  }
  EXPECT_EQ(look.response.running, 4u) << look.response.message;
  Crowd("4 long requests");
  CancelWork cancel;
  const Clock::time_point begin = Clock::now();
  ASSERT_TRUE(ros::service::call(Path("cancel"), cancel));
  EXPECT_GE(cancel.response.cancelled, 4u);
  for (std::thread& thread : long_ones) thread.join();
  EXPECT_LT(Since(begin), 1) << "what ~cancel promises";
  EXPECT_EQ(cancelled, 4);
}

}  // namespace
}  // namespace contact_flow

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "clients_test");
  ros::NodeHandle node;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}
