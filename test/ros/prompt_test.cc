// SPDX-License-Identifier: BSD-3-Clause
// What only hands something on is answered at once, also where long requests run and wait, a mark
// is rolled and recordings begin and end. How soon is printed, and judged where ~limit says so.
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "contact_flow/CancelWork.h"
#include "contact_flow/DescribeModel.h"
#include "contact_flow/GetSimulatorState.h"
#include "contact_flow/MarkInstant.h"
#include "contact_flow/SetInput.h"
#include "contact_flow/SimulateTrajectory.h"
#include "contact_flow/StartRecording.h"
#include "contact_flow/StepSimulation.h"
#include "contact_flow/StopRecording.h"

namespace contact_flow {
namespace {

using Clock = std::chrono::steady_clock;

double Since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

std::string Path(const char* service) { return std::string("/hurried/") + service; }

/// One connection for each service, and how long its calls have taken.
class Caller {
 public:
  /// Is it answered?
  template <class Service>
  bool Call(const char* name, Service* service) {
    ros::ServiceClient& client = clients_[name];
    if (!client.isValid()) {
      ros::service::waitForService(Path(name), ros::Duration(30));
      client = ros::NodeHandle().serviceClient<Service>(Path(name), true);
    }
    const Clock::time_point begin = Clock::now();
    const bool answered = client.call(*service);
    seconds_[name].push_back(Since(begin));
    return answered;
  }
  void Forget() { seconds_.clear(); }
  /// Returns the slowest of all [s].
  double Print() {
    double slowest = 0;
    for (auto& [name, all] : seconds_) {
      std::sort(all.begin(), all.end());
      std::printf("%-16s %6zu calls, ms: median %7.2f  p99 %7.2f  most %7.2f\n", name.c_str(),
                  all.size(), 1e3 * all[all.size() / 2], 1e3 * all[(all.size() - 1) * 99 / 100],
                  1e3 * all.back());
      slowest = std::max(slowest, all.back());
    }
    return slowest;
  }

 private:
  std::map<std::string, ros::ServiceClient> clients_;
  std::map<std::string, std::vector<double>> seconds_;
};

/// Once through all that is prompt.
void Round(Caller* caller, std::vector<std::string>* paths) {
  std_srvs::Empty empty;
  GetSimulatorState state;
  StepSimulation step;
  SetInput input;
  MarkInstant mark;
  CancelWork look;
  DescribeModel describe;
  StartRecording start;
  StopRecording stop;
  step.request.seconds = 0.01;
  mark.request.project_directions = true;
  look.request.ask_only = true;
  EXPECT_TRUE(caller->Call("start_recording", &start) && start.response.success)
      << start.response.message;
  EXPECT_TRUE(caller->Call("get_state", &state) && state.response.success);
  EXPECT_TRUE(caller->Call("pause_physics", &empty));
  EXPECT_TRUE(caller->Call("step", &step) && step.response.success) << step.response.message;
  EXPECT_TRUE(caller->Call("get_state", &state) && state.response.paused);
  EXPECT_TRUE(caller->Call("set_input", &input) && input.response.success);
  EXPECT_TRUE(caller->Call("mark", &mark) && mark.response.success) << mark.response.message;
  EXPECT_TRUE(caller->Call("unpause_physics", &empty));
  EXPECT_TRUE(caller->Call("cancel", &look) && look.response.success);
  EXPECT_TRUE(caller->Call("describe_model", &describe) && describe.response.success);
  EXPECT_TRUE(caller->Call("stop_recording", &stop) && stop.response.success)
      << stop.response.message;
  for (const std::string& path : stop.response.paths) paths->push_back(path);
  // From the beginning: a run that has ended would not be paused and stepped any more.
  EXPECT_TRUE(caller->Call("reset_simulation", &empty));
}

TEST(Prompt, ServicesAreAnsweredBesideLongRequests) {
  ros::NodeHandle own("~");
  const double seconds = own.param("seconds", 3.0), limit = own.param("limit", 0.0);
  Caller caller;
  CancelWork look;
  ASSERT_TRUE(caller.Call("cancel", &look));
  std::vector<std::thread> long_ones;
  for (int k = 0; k < 8; ++k) {  // four run, four wait
    long_ones.emplace_back([] {
      SimulateTrajectory run;
      run.request.duration = 1e5;
      run.request.samples = 1;
      run.request.options.max_step = 1e-6;
      run.request.options.max_steps = 1000000000;
      run.request.options.max_seconds = 3600;
      EXPECT_TRUE(ros::service::call(Path("simulate"), run));
      EXPECT_EQ(run.response.outcome, SimulateTrajectory::Response::CANCELLED);
    });
  }
  look.request.ask_only = true;
  for (int k = 0; k < 200 && look.response.running + look.response.waiting < 8; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ASSERT_TRUE(caller.Call("cancel", &look));
  }
  EXPECT_EQ(look.response.running, 4u);
  EXPECT_EQ(look.response.waiting, 4u);

  std::vector<std::string> paths;
  Round(&caller, &paths);  // which makes the connections
  caller.Forget();
  const Clock::time_point begin = Clock::now();
  while (Since(begin) < seconds && !HasFailure()) {
    Round(&caller, &paths);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // it moves meanwhile
  }
  const double slowest = caller.Print();
  if (limit > 0) {
    EXPECT_LE(slowest, limit) << "the slowest answer [s]";
  }
  CancelWork cancel;
  EXPECT_TRUE(caller.Call("cancel", &cancel));
  EXPECT_EQ(cancel.response.cancelled, 8u);
  for (std::thread& thread : long_ones) thread.join();
  for (const std::string& path : paths) std::filesystem::remove(path);
}

}  // namespace
}  // namespace contact_flow

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "prompt_test");
  ros::NodeHandle node;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}
