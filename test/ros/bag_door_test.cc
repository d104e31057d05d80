// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/bag_door.h"

#include <gtest/gtest.h>
#include <std_msgs/Float64.h>

#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "contact_flow/ros/bag_file.h"
#include "contact_flow/ros/stream_recorder.h"

namespace contact_flow {
namespace ros_interface {
namespace {

BagEntry Number(double number) {
  auto message = boost::make_shared<std_msgs::Float64>();
  message->data = number;
  return MakeBagEntry<std_msgs::Float64>("/number", ros::Time(1), "/test", message);
}

/// Results are recorded by one thread, others start and stop recordings: what two ordinary clients
/// of a node do. Without one door for all bags this died within 2 s.
TEST(BagDoor, BagsComeAndGoInManyThreads) {
  const std::string directory = testing::TempDir() + "/bag_door";
  std::filesystem::remove_all(directory);
  std::filesystem::create_directories(directory);
  std::vector<std::thread> threads;
  for (int k = 0; k < 3; ++k) {
    threads.emplace_back([&, k] {
      for (int i = 0; i < 40; ++i) {
        ReplaceBag(directory + "/result_" + std::to_string(k) + ".bag", {Number(i)});
      }
    });
    threads.emplace_back([&, k] {
      StreamRecorder recorder(directory);
      for (int i = 0; i < 40; ++i) {
        recorder.Start(
            "stream_" + std::to_string(k) + "_" + std::to_string(i),
            [](const ros::Time&) { return Number(0); }, ros::Time(1));
        recorder.Write(ros::Time(1), Number(i));
        recorder.Stop();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const std::unique_ptr<rosbag::Bag> bag =
      OpenBag(directory + "/result_0.bag", rosbag::bagmode::Read);
  EXPECT_TRUE(bag->isOpen());
  std::filesystem::remove_all(directory);
}

TEST(BagDoor, ABagThatCannotBeOpenedIsAnException) {
  EXPECT_THROW(OpenBag("/nowhere/at/all.bag", rosbag::bagmode::Read), rosbag::BagException);
  EXPECT_NO_THROW(CloseBag(nullptr));
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
