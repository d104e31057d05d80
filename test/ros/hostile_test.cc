// SPDX-License-Identifier: BSD-3-Clause
// A siege: hostile requests of all services, actions, topics and settings of a live node, from
// several clients at once over connections that stay. It does not die, answers within its budget
// and ~slack, keeps its memory, answers good requests in between to the bits of this process, and
// what it refuses it refuses by the name of a field. A request depends on its number alone: ~seed
// and ~requests:=1 send one again.
#include <gtest/gtest.h>
#include <ros/console.h>
#include <ros/network.h>
#include <ros/ros.h>
#include <unistd.h>
#include <xmlrpcpp/XmlRpc.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "test/ros/besieger.h"
#include "test/ros/goals.h"
#include "test/ros/siege.h"

namespace contact_flow {
namespace fuzz {
namespace {

/// A number of /proc/PID/status [MB].
double Memory(int process, const std::string& key) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  std::string word;
  double kilobytes = 0;
  while (status >> word) {
    if (word == key + ":") status >> kilobytes;
  }
  return 1e-3 * kilobytes;
}

int ProcessOf(const std::string& node) {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  request[1] = node;
  if (!ros::master::execute("lookupNode", request, response, payload, true)) return 0;
  std::string host;
  std::uint32_t port = 0;
  ros::network::splitURI(static_cast<std::string>(payload), host, port);
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port));
  XmlRpc::XmlRpcValue caller, answer;
  caller[0] = ros::this_node::getName();
  if (!client.execute("getPid", caller, answer)) return 0;
  return static_cast<int>(answer[2]);
}

TEST(Hostile, RequestsAreAnsweredOrRefused) {
  ros::NodeHandle own("~");
  const long requests = own.param("requests", 6000);
  const int clients = own.param("clients", 3);
  const double budget = own.param("budget", 1.0), slack = own.param("slack", 20.0);
  const double memory = own.param("memory", 3000.0);
  Siege siege(own.param<std::string>("model", "soft_biped"), budget + slack);
  for (const WireKind& kind : siege.kinds()) {
    ASSERT_TRUE(ros::service::waitForService("/besieged/" + kind.service, ros::Duration(30)));
  }
  ASSERT_TRUE(ros::service::waitForService("/legged/get_state", ros::Duration(30)));
  const int process = ProcessOf("/besieged");
  ASSERT_GT(process, 0);
  siege.Begin(static_cast<unsigned long>(own.param("seed", 1)), requests);
  std::vector<std::thread> threads;
  for (int k = 0; k < clients; ++k) threads.emplace_back([&siege] { Besieger(&siege).Run(); });
  threads.emplace_back([&siege] { PursueGoals(&siege); });
  const ros::WallTime begin = ros::WallTime::now();
  double told = 0;
  while (!siege.Over()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const std::string hangs = siege.Hanging(2 * (budget + slack) + 10);
    if (!hangs.empty()) {
      ADD_FAILURE() << "no answer to " << hangs;
      _exit(1);  // whoever waits would wait for ever
    }
    const double passed = (ros::WallTime::now() - begin).toSec();
    if (passed < told + 60) continue;
    told = passed;
    std::printf("%.0f s: %s\n", passed, siege.Count().c_str());
    std::fflush(stdout);
  }
  for (std::thread& thread : threads) thread.join();
  std::printf("%.0f s: %s\nresident at most %.0f MB\n", (ros::WallTime::now() - begin).toSec(),
              siege.Count().c_str(), Memory(process, "VmHWM"));
  EXPECT_GT(Memory(process, "VmHWM"), 0) << "the node has died";
  EXPECT_LT(Memory(process, "VmHWM"), memory);
  EXPECT_TRUE(siege.Wrong().empty()) << siege.Wrong();
  EXPECT_GT(siege.good(), 0);
}

}  // namespace
}  // namespace fuzz
}  // namespace contact_flow

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "hostile_test");
  if (ros::console::set_logger_level(ROSCONSOLE_DEFAULT_NAME, ros::console::levels::Fatal)) {
    ros::console::notifyLoggerLevelsChanged();
  }
  ros::console::set_logger_level("ros.roscpp", ros::console::levels::Fatal);
  ros::NodeHandle node;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}
