// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <vector>

#include "src/ros/message/serialize.h"
#include "src/ros/session/session.h"

namespace contact_flow {
namespace ros_interface {
namespace {

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// As long as a call may take that has this much time [s], on a busy machine.
double Patience(double seconds) { return 3 * seconds + 2; }

InitialState Quick(double speed) {
  InitialState state;
  state.names = {"body_pitch"};
  state.velocities = {speed};
  return state;
}

TEST(SessionLimits, AMotionThatIsTooQuickEndsItsEpoch) {
  Session session(Configuration(), {}, {});
  session.LimitSteps({0.3, 0.02, 0.1});
  session.SetState(Quick(1e9));
  const double begin = Now();
  int calls = 0;
  double longest = 0;
  while (session.status().ok() && session.now() < 0.01 && calls < 1000) {
    const double since = Now();
    session.AdvanceTo(session.now() + 2e-3);
    longest = std::max(longest, Now() - since);
    ++calls;
  }
  EXPECT_EQ(Outcome::kBudgetExceeded, session.status().outcome);
  EXPECT_NE(std::string::npos, session.status().message.find("step_seconds = 0.3"));
  EXPECT_LT(Now() - begin, Patience(0.3));
  EXPECT_GT(calls, 2) << "it gives way to commands in between";
  EXPECT_LT(longest, Patience(0.02));
  EXPECT_TRUE(session.State().allFinite());
  session.ResetSimulation();
  session.AdvanceTo(0.1);
  EXPECT_TRUE(session.status().ok());
  EXPECT_EQ(0.1, session.now());
}

/// Giving way on the way changes nothing: the same bits as without limits.
TEST(SessionLimits, AreNotPartOfTheMotion) {
  Session free(Configuration(), {}, {}), limited(Configuration(), {}, {});
  limited.LimitSteps({1e6, 1e-6, 1e6});
  free.SetState(Quick(50));
  limited.SetState(Quick(50));
  SimulatorMark mark;
  mark.project_directions = true;
  free.Mark(mark);
  limited.Mark(mark);
  int ways = 0;
  for (int k = 1; k <= 100; ++k) {
    const double t = 5e-3 * k;
    while (free.now() < t && free.status().ok()) free.AdvanceTo(t);
    while (limited.now() < t && limited.status().ok()) {
      limited.AdvanceTo(t);
      ways += limited.now() < t;
    }
    ASSERT_EQ(Serialize(free.StateMsg()), Serialize(limited.StateMsg())) << t;
    ASSERT_EQ(Serialize(*free.TangentsMsg()), Serialize(*limited.TangentsMsg())) << t;
  }
  EXPECT_GT(ways, 0);
}

TEST(SessionLimits, AMarkThatIsTooExpensiveIsLostAndTold) {
  std::vector<SimulatorMark> told;
  Session::Log log;
  log.mark = [&](const SimulatorMark& mark) { told.push_back(mark); };
  Session session(Configuration(), {}, log);
  session.LimitSteps({1e6, 1e6, 1e-7});
  SimulatorMark mark;
  mark.project_directions = true;
  session.Mark(mark);
  session.AdvanceTo(0.05);
  EXPECT_FALSE(session.marked());
  EXPECT_FALSE(session.TangentsMsg());
  ASSERT_EQ(2u, told.size());
  EXPECT_TRUE(told[1].clear);
  EXPECT_EQ(session.now(), told[1].t);
  EXPECT_TRUE(session.status().ok()) << "the motion goes on";
}

TEST(SessionLimits, InputsAreToldForTheNextHourAndNotWithoutEnd) {
  Configuration configuration;
  configuration.model = "falling_box";
  Session session(configuration, {}, {});
  const std::vector<double> u(session.setup()->system->nominal().u.size(), 0.0);
  EXPECT_THROW(session.SetInput(4e9, {}, u), std::invalid_argument);
  EXPECT_THROW(session.SetInput(std::nan(""), {}, u), std::invalid_argument);
  for (int k = 1; k <= 10000; ++k) session.SetInput(0.1 * k, {}, u);
  EXPECT_THROW(session.SetInput(2000, {}, u), std::invalid_argument);
}

TEST(SessionLimits, AnEpochThatIsEndedKeepsItsReason) {
  Session session(Configuration(), {}, {});
  session.End(Outcome::kNonFinite, "something went wrong");
  session.End(Outcome::kNonFinite, "and again");
  EXPECT_EQ("something went wrong (stopped at t = 0 s)", session.status().message);
  EXPECT_FALSE(session.AdvanceTo(1));
  EXPECT_EQ(0, session.now());
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
