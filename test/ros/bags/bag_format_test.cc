// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <topic_tools/shape_shifter.h>

#include <cstdio>
#include <fstream>

#include "test/ros/bags/sample.h"

namespace contact_flow {
namespace ros_interface {
namespace {

std::string WriteTemporary(const std::string& bytes) {
  const std::string path = testing::TempDir() + "bag_format_test.bag";
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

// What is written here is read by rosbag, message for message.
TEST(BagFormat, RosbagReadsWhatIsWritten) {
  const std::string bytes = SampleBag(50);
  const BagContent ours = ReadBag(bytes);
  rosbag::Bag bag(WriteTemporary(bytes), rosbag::bagmode::Read);
  rosbag::View view(bag);
  ASSERT_EQ(view.size(), ours.messages.size());
  std::size_t i = 0;
  for (const rosbag::MessageInstance& theirs : view) {
    const BagMessage& message = ours.messages[i++];
    EXPECT_EQ(theirs.getTopic(), message.connection->at("topic"));
    EXPECT_EQ(theirs.getTime(), message.time);
    EXPECT_EQ(theirs.getCallerId(), "/node");
    EXPECT_EQ(theirs.isLatching(), message.connection->at("latching") == "1");
    std::vector<std::uint8_t> data(theirs.size());
    ros::serialization::OStream stream(data.data(), static_cast<std::uint32_t>(data.size()));
    theirs.write(stream);
    EXPECT_EQ(data, Bytes(message.data, message.data + message.size));
  }
}

// What rosbag writes is read here: many messages a chunk, two connections, equal times.
TEST(BagFormat, WhatRosbagWritesIsRead) {
  const std::string path = testing::TempDir() + "rosbag_writes.bag";
  std::vector<SimulatorInput> inputs(2000);
  {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    bag.setChunkThreshold(10000);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      inputs[k].t = static_cast<double>(k);
      inputs[k].input.assign(k % 7, 1.5);
      bag.write(k % 2 ? "/a" : "/b", ros::Time(1 + static_cast<unsigned>(k / 3)), inputs[k]);
    }
  }
  const std::string bytes = ReadRegularFile(path);
  const BagContent content = ReadBag(bytes);
  EXPECT_TRUE(content.closed);
  ASSERT_EQ(content.messages.size(), inputs.size());
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    EXPECT_EQ(content.messages[k].connection->at("topic"), k % 2 ? "/a" : "/b");
    EXPECT_EQ(Serialize(Deserialize<SimulatorInput>(content.messages[k])), Serialize(inputs[k]));
  }
}

TEST(BagFormat, OneThatWasNeverClosedIsReadAsFarAsItGoes) {
  BagConnections connections("/node");
  RecordingPlan plan("online", "/node", &connections);
  ChainedBag bag(plan);
  std::string bytes = bag.Begin(ros::Time(1, 0));
  std::vector<std::size_t> ends = {bytes.size()};
  for (int k = 0; k < 5; ++k) {
    bytes += bag.Add(SampleEntry(&connections, k), ros::Time(2, 0));
    ends.push_back(bytes.size());
  }
  for (std::size_t size = ends.front(); size <= bytes.size(); ++size) {
    const std::string cut = bytes.substr(0, size);
    const BagContent content = ReadBag(cut);
    EXPECT_FALSE(content.closed);
    // The message counts once its chunk is whole; its index, of 60 bytes and more, may be cut.
    const auto whole =
        static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), size) - ends.begin());
    EXPECT_GE(content.messages.size(), whole);
    EXPECT_LE(content.messages.size(), whole + 1);
    EXPECT_EQ(Complaint(cut).compare(0, 3, "gap"), 0) << Complaint(cut);
  }
}

TEST(BagFormat, SaysWhereItIsDamaged) {
  std::string bytes = SampleBag(20);
  EXPECT_EQ(Complaint(bytes), "");
  std::string padding = bytes;
  padding[2000] = 'x';
  EXPECT_EQ(Complaint(padding), "damaged at byte 2000: not a space");
  EXPECT_EQ(Complaint(bytes.substr(0, bytes.size() - 1)).compare(0, 16, "damaged at byte "), 0);
  EXPECT_EQ(Complaint("").compare(0, 17, "damaged at byte 0"), 0);
}

// A length that lies does not make the reader allocate it.
TEST(BagFormat, MessagesWhoseLengthsLieAreRefused) {
  SimulatorInput input;
  input.input = {1, 2};
  Bytes bytes = Serialize(input);
  bytes[bytes.size() - 20] = 7;  // of the array: 2 → 7
  const BagMessage message{
      BagConnections("/node").Of<SimulatorInput>("/a", false), {}, bytes.data(), bytes.size()};
  EXPECT_THROW(Deserialize<SimulatorInput>(message), std::runtime_error);
  bytes[bytes.size() - 20] = 1;  // … → 1
  EXPECT_THROW(Deserialize<SimulatorInput>(message), std::runtime_error);
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
