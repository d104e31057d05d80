// SPDX-License-Identifier: BSD-3-Clause
// forge_bag IN OUT: the messages of a bag of one part under a new chain and a sound index, as one
// writes who knows how, but does not have the key. Links of IN say where, and how, links go.
#include <fstream>
#include <iostream>

#include "test/ros/bags/sample.h"

namespace contact_flow {
namespace ros_interface {
namespace {

int Forge(const std::string& in, const std::string& out) {
  const std::string bytes = ReadRegularFile(in);
  const BagContent bag = ReadBag(bytes);
  BagConnections connections("");
  RecordingPlan plan("", "", &connections);
  std::string forged;
  std::unique_ptr<ChainedBag> chained;
  ros::Time before;
  for (const BagMessage& message : bag.messages) {
    if (Is<RecordingStart>(message) && !chained) {
      plan.start = Deserialize<RecordingStart>(message);
      plan.start_connection = message.connection;
      for (const BagMessage& other : bag.messages) {
        if (Is<RecordingLink>(other)) plan.link_connection = other.connection;
      }
      chained = std::make_unique<ChainedBag>(plan);
      forged = chained->Begin(message.time);
    } else if (Is<RecordingLink>(message)) {
      if (chained) forged += chained->Link(Deserialize<RecordingLink>(message).state);
    } else if (chained) {
      // A time that was moved on by one is moved on again.
      const bool moved = message.time == before + ros::Duration(0, 1);
      const Bytes data(message.data, message.data + message.size);
      forged += chained->Add({message.connection, [&] { return data; }},
                             moved ? ros::Time() : message.time);
    }
    before = message.time;
  }
  if (!chained) return 1;
  forged += chained->End();
  const std::string head = chained->Head();
  forged.replace(0, head.size(), head);
  std::ofstream(out, std::ios::binary) << forged;
  return 0;
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "Usage: forge_bag IN OUT\n";
    return 2;
  }
  return contact_flow::ros_interface::Forge(argv[1], argv[2]);
}
