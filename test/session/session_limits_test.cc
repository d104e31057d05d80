// SPDX-License-Identifier: BSD-3-Clause
// What an instant of a session may take. Limits are counted here, in questions to the clock.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "src/session/session.h"
#include "test/session/same_bits.h"

namespace contact_flow {
namespace {

/// A clock that goes on by 1 s whenever it is asked: the work between two questions is what it is
/// on every machine.
struct Counter {
  double asked = 0;

  StepClock Clock() {
    const auto count = [this] { return asked++; };
    return {count, count, 0};
  }
};

AskedState Quick(double speed) {
  AskedState state;
  state.names = {"body_pitch"};
  state.velocities = {speed};
  return state;
}

AskedMark Projected() {
  AskedMark mark;
  mark.directions.project = true;
  return mark;
}

TEST(SessionLimits, AMotionThatIsTooQuickEndsItsEpoch) {
  constexpr double kStep = 3000, kSlice = 200;
  Counter counter;
  Session session(Configuration(), {}, {}, counter.Clock());
  session.LimitSteps({kStep, kSlice, 1000});
  session.SetState(Quick(1e9));
  counter.asked = 0;
  int calls = 0;
  double longest = 0;
  while (session.status().ok() && session.now() < 0.01 && calls < 1000) {
    const double since = counter.asked;
    session.AdvanceTo(session.now() + 2e-3);
    longest = std::max(longest, counter.asked - since);
    ++calls;
  }
  EXPECT_EQ(Outcome::kBudgetExceeded, session.status().outcome);
  EXPECT_NE(std::string::npos, session.status().message.find("step_seconds = 3000"))
      << session.status().message;
  EXPECT_GT(calls, kStep / kSlice / 2) << "it gives way to commands in between";
  EXPECT_LE(longest, kSlice + 10);
  EXPECT_LE(counter.asked, kStep + kSlice + 10);
  EXPECT_TRUE(session.State().allFinite());
  session.ResetSimulation();
  while (session.now() < 0.1 && session.status().ok()) session.AdvanceTo(0.1);
  EXPECT_TRUE(session.status().ok());
  EXPECT_EQ(0.1, session.now());
}

/// Giving way on the way changes nothing: the same bits as without limits.
TEST(SessionLimits, AreNotPartOfTheMotion) {
  Counter counter;
  Session free(Configuration(), {}, {}), limited(Configuration(), {}, {}, counter.Clock());
  limited.LimitSteps({1e9, 0.5, 1e9});  // at the first question
  free.SetState(Quick(50));
  limited.SetState(Quick(50));
  free.Mark(Projected());
  limited.Mark(Projected());
  int ways = 0;
  for (int k = 1; k <= 100; ++k) {
    const double t = 5e-3 * k;
    while (free.now() < t && free.status().ok()) free.AdvanceTo(t);
    while (limited.now() < t && limited.status().ok()) {
      limited.AdvanceTo(t);
      ways += limited.now() < t;
    }
    ASSERT_TRUE(SameBits(free.Now(), limited.Now())) << t;
    ASSERT_TRUE(SameBits(*free.ReadMark(), *limited.ReadMark())) << t;
  }
  EXPECT_GT(ways, 10);
}

TEST(SessionLimits, AMarkThatIsTooExpensiveIsLostAndTold) {
  std::vector<AskedMark> told;
  std::vector<std::string> warnings;
  Session::Log log;
  log.mark = [&](const AskedMark& mark) { told.push_back(mark); };
  log.warning = [&](const std::string& sentence) { warnings.push_back(sentence); };
  Counter counter;
  Session session(Configuration(), {}, log, counter.Clock());
  session.LimitSteps({1e9, 1e9, 0.5});
  session.Mark(Projected());
  session.AdvanceTo(0.05);
  EXPECT_FALSE(session.marked());
  EXPECT_FALSE(session.ReadMark());
  ASSERT_EQ(2u, told.size());
  EXPECT_TRUE(told[1].clear);
  EXPECT_EQ(session.now(), told[1].t);
  ASSERT_EQ(1u, warnings.size());
  EXPECT_NE(std::string::npos, warnings[0].find("more than 0.5 s")) << warnings[0];
  EXPECT_TRUE(session.status().ok()) << "the motion goes on";
  EXPECT_EQ(0.05, session.now());
}

/// Of processor time, however long the thread waits: that of a clock that stands still is never up.
TEST(SessionLimits, AreOfWorkAndNotOfWaiting) {
  double wall = 0;
  StepClock clock;
  clock.processor = [] { return 0.0; };
  clock.wall = [&wall] { return wall += 10; };
  clock.look_every = 0;
  Session session(Configuration(), {}, {}, clock);
  session.LimitSteps({1e-9, 5, 1e-9});
  session.Mark(Projected());
  int calls = 0;
  while (session.now() < 0.05 && session.status().ok() && calls < 1000) {
    session.AdvanceTo(0.05);
    ++calls;
  }
  EXPECT_GT(calls, 1) << "others wait no longer than a slice";
  EXPECT_TRUE(session.status().ok()) << session.status().message;
  EXPECT_TRUE(session.marked());
  EXPECT_EQ(0.05, session.now());
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
}  // namespace contact_flow
