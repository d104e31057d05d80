// SPDX-License-Identifier: BSD-3-Clause
#include "src/ros/message/gate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "contact_flow/ComputePoincareMap.h"
#include "contact_flow/InputCommand.h"
#include "contact_flow/PoincareRequest.h"
#include "contact_flow/SimulationRequest.h"
#include "contact_flow/StabilityRequest.h"
#include "src/ros/answer/answers.h"
#include "src/ros/answer/poincare_answer.h"
#include "src/ros/display/stamps.h"
#include "test/refusal.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using test::RefusalOf;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Message>
std::string Refused(const Message& message) {
  return RefusalOf([&] { CheckMessage(message); });
}

TEST(Gate, NamesTheFieldAndTheNumber) {
  SimulationRequest request;
  request.state.q = {1, 2, 3, 4};
  EXPECT_EQ("", Refused(request));
  request.state.q[3] = kNan;
  EXPECT_EQ("state.q[3] is nan, expected a finite number", Refused(request));
  request.state.q[3] = 1e308;
  EXPECT_EQ("state.q[3] is 1e+308, expected a number up to 1e100 in size", Refused(request));
  request.state.q[3] = 5e-324;  // states that come out of runs may be as small
  EXPECT_EQ("", Refused(request));
  request.options.max_seconds = -HUGE_VAL;
  EXPECT_EQ("options.max_seconds is -inf, expected a finite number", Refused(request));
}

TEST(Gate, GoesThroughMessagesInMessagesAndLists) {
  StabilityRequest request;
  request.map.resize(2);
  request.map[1].cone.data = {0, kNan};
  EXPECT_EQ("map[1].cone.data[1] is nan, expected a finite number", Refused(request));
  request.map.clear();
  request.return_map.section.value = kNan;
  EXPECT_EQ("return_map.section.value is nan, expected a finite number", Refused(request));
  ComputePoincareMap::Request service;
  service.derivative_options.tolerance = kNan;
  EXPECT_EQ("derivative_options.tolerance is nan, expected a finite number", Refused(service));
  InputCommand command;
  command.header.stamp = ros::TIME_MAX;
  command.header.frame_id = "anywhere";
  command.values = {0, HUGE_VAL};
  EXPECT_EQ("values[1] is inf, expected a finite number", Refused(command));
}

TEST(Gate, LimitsSizes) {
  SimulationRequest request;
  request.options.impact_law.assign(100000, 'x');
  EXPECT_EQ("options.impact_law has 100000 bytes, at most 4096 are accepted", Refused(request));
  request.options.impact_law.clear();
  request.state.names = {"a", std::string(5000, 'b')};
  EXPECT_EQ("state.names[1] has 5000 bytes, at most 4096 are accepted", Refused(request));
  request.state.names.clear();
  request.input.resize(kMostEntries + 1);
  EXPECT_NE(std::string::npos, Refused(request).find("input has 4000001 entries"));
}

TEST(FieldNames, AreThoseOfTheDefinition) {
  const std::vector<std::string> expected = {"header", "a", "b"};
  EXPECT_EQ(expected,
            FieldNames("# text\nstd_msgs/Header header\nuint8 ONE=1  # x\nfloat64 a # = 1\n"
                       "float64[] b\n====\nMSG: std_msgs/Header\nuint32 seq\n"));
}

TEST(PoincareAnswer, RefusesWhatHungTheNode) {
  Configuration configuration;
  const contact_flow::Setup setup(configuration);
  PoincareRequest request;
  request.section.kind = "apex";
  request.section.name = "body_z";
  request.horizon = 5e-324;
  EXPECT_EQ("horizon is 4.94066e-324, expected 1e-09 to 1e+06",
            RefusalOf([&] { Answer(setup, request); }));
  request.horizon = 0;
  request.neutral.cols = 5;
  EXPECT_NE(std::string::npos, RefusalOf([&] { Answer(setup, request); }).find("neutral"));
}

TEST(Stamps, GoToTheEndOfTimeAndNoFurther) {
  Stamps stamps;
  stamps.Anchor(0, ros::Time(1600000000));
  EXPECT_EQ(ros::Time(1600000001), stamps.At(1));
  EXPECT_EQ(1.0, stamps.TimeOf(ros::Time(1600000001)));
  // 4000000000 s is later than a ros::Duration reaches: it threw, and ended the simulator.
  EXPECT_EQ(2.4e9, stamps.TimeOf(ros::Time(4000000000)));
  EXPECT_EQ(-1.6e9, stamps.TimeOf(ros::Time(0, 0)));
  EXPECT_EQ(ros::TIME_MAX, stamps.Take(1e12));
  EXPECT_EQ(ros::TIME_MAX, stamps.Take(2e12));
  stamps.Anchor(0, ros::Time(5));
  EXPECT_EQ(ros::TIME_MAX, stamps.Take(0));
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
