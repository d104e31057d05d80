// SPDX-License-Identifier: BSD-3-Clause
#include "src/ros/recording/record_types.h"

#include <gtest/gtest.h>
#include <ros/message_traits.h>

#include <filesystem>
#include <set>
#include <string>
#include <type_traits>

namespace contact_flow {
namespace ros_interface {
namespace {

/// What a topic has: the type of its messages.
template <class Message>
std::string TypeName(const Message&) {
  return ros::message_traits::DataType<Message>::value();
}

/// The definitions of the package say which records there are.
TEST(RecordTypes, AreAllThatAreDefined) {
  std::set<std::string> defined, listed;
  const std::filesystem::path package = std::filesystem::path(CONTACT_FLOW_TEST_DATA) / "../..";
  const std::string end = "Record.msg";
  for (const auto& file : std::filesystem::directory_iterator(package / "msg")) {
    const std::string name = file.path().filename().string();
    if (name.size() <= end.size() || name.substr(name.size() - end.size()) != end) continue;
    defined.insert("contact_flow/" + file.path().stem().string());
  }
  ForEachRecordType([&](const auto& type) {
    using Record = typename std::decay_t<decltype(type)>::Record;
    listed.insert(TypeName(Record()));
  });
  EXPECT_GT(defined.size(), 10u);
  EXPECT_EQ(defined, listed);
}

/// verify_bag knows messages by their types, and what they are by their topics.
TEST(RecordTypes, HaveTypesAndTopicsOfTheirOwn) {
  std::set<std::string> types, roles;
  std::size_t count = 0;
  ForEachRecordType([&](const auto& type) {
    types.insert(TypeName(typename std::decay_t<decltype(type)>::Record()));
    roles.insert(type.Role());
    ++count;
  });
  ForEachResultTopic([&](const auto&, const auto& topic) {
    types.insert(TypeName(typename std::decay_t<decltype(topic)>::Message()));
    roles.insert(topic.name);
    ++count;
  });
  EXPECT_EQ(count, types.size());
  EXPECT_EQ(count, roles.size());
}

/// As bags have them since the first version: recorded with every bag.
TEST(RecordTypes, KeepTheirTopics) {
  const std::vector<std::string> roles = {
      "trajectory",          "mode_sequence",     "b_derivative",         "record/simulation",
      "record/derivative",   "record/comparison", "record/assumptions",   "record/linearization",
      "record/poincare_map", "record/stability",  "record/step_feedback", "record/controllability",
      "record/covariance",   "record/gradient",   "record/policy",        "record/periodic_orbit",
      "record/optimization", "record/trajectory", "record/ensemble"};
  EXPECT_EQ(roles, ResultRoles());
}

TEST(RecordTypes, MakeTheMessagesOfTheirTopics) {
  ContactTrajectory result;
  result.header.frame_id = "odom";
  result.model = "paddle";
  result.arcs.resize(2);
  result.arcs[1].mode_word = "s";
  const auto& topics = RecordTypeOf<SimulationRecord>().topics;
  EXPECT_EQ(result, std::get<0>(topics).Of(result));
  const ModeSequence modes = std::get<1>(topics).Of(result);
  EXPECT_EQ(result.header, modes.header);
  EXPECT_EQ("paddle", modes.model);
  ASSERT_EQ(2u, modes.modes.size());
  EXPECT_EQ("s", modes.modes[1].mode_word);
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
