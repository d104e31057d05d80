// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <boost/make_shared.hpp>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/SimulatorInput.h"
#include "contact_flow/SimulatorMark.h"
#include "src/ros/recording/bag_reader.h"
#include "src/ros/recording/chained_bag.h"
#include "src/ros/recording/deserialize.h"
#include "src/ros/verification/chain_check.h"

namespace contact_flow {
namespace ros_interface {

inline BagEntry SampleEntry(BagConnections* connections, int k) {
  if (k % 3 == 0) {
    SimulatorMark mark;
    mark.t = 0.1 * k;
    mark.directions = {"+x", "-x"};
    return connections->Entry("/node/mark_taken", boost::make_shared<const SimulatorMark>(mark));
  }
  SimulatorInput input;
  input.t = 0.1 * k;
  input.input = {1.0 * k, 2.0};
  return connections->Entry("/node/input_taken", boost::make_shared<const SimulatorInput>(input),
                            false);
}

/// The bytes of a bag of a recording that was ended, with `count` messages and a link
/// after every fourth.
inline std::string SampleBag(int count, std::shared_ptr<const SigningKey> key = nullptr,
                             bool ended = true) {
  BagConnections connections("/node");
  RecordingPlan plan("online", "/node", &connections);
  plan.key = std::move(key);
  ChainedBag bag(plan);
  std::string bytes = bag.Begin(ros::Time(100, 0));
  for (int k = 0; k < count; ++k) {
    bytes +=
        bag.Add(SampleEntry(&connections, k), ros::Time(100, 1000u * static_cast<unsigned>(k)));
    if (k % 4 == 3) bytes += bag.Link(RecordingLink::GOES_ON);
  }
  if (ended) bytes += bag.Link(RecordingLink::RECORDING_ENDS);
  bytes += bag.End();
  const std::string head = bag.Head();
  return bytes.replace(0, head.size(), head);
}

/// The same messages, written anew, with a sound index.
inline std::string Reindexed(const std::vector<BagMessage>& messages) {
  BagEncoder encoder;
  std::string bytes = BagEncoder::Begin();
  for (const BagMessage& message : messages) {
    bytes += encoder.Message(message.connection, message.time,
                             Bytes(message.data, message.data + message.size));
  }
  bytes += encoder.End();
  const std::string head = encoder.Head();
  return bytes.replace(0, head.size(), head);
}

/// What there is to say of the bytes of a bag; "" when they are as they were recorded.
inline std::string Complaint(const std::string& bytes,
                             std::shared_ptr<const SigningKey> key = nullptr) {
  try {
    const BagContent bag = ReadBag(bytes);
    ChainCheck chain(std::move(key));
    const ChainCheck::Report report = chain.Take(bag);
    if (!report.differences.empty()) return "differs: " + report.differences.front();
    if (!report.gaps.empty()) return "gap: " + report.gaps.front();
    return chain.End().empty() ? "" : "gap: " + chain.End();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
