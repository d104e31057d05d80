// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/samples.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>
#include <string>

#include "contact_flow/budget.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

class SamplesTest : public testing::Test {
 protected:
  SamplesTest()
      : system(MakeModel("ball_in_corner")),
        trajectory(Simulate(*system, system->nominal().x, system->nominal().u, 1.0)) {}

  std::unique_ptr<MechanicalSystem> system;
  Trajectory trajectory;
};

TEST_F(SamplesTest, AskTheirBudget) {
  BudgetLimits limits;
  limits.look_every = 0;
  limits.cancelled = [] { return true; };
  const BudgetScope scope{Budget(limits)};
  EXPECT_THROW(SampleTrajectory(trajectory, 1000000), BudgetExceeded);
  std::ostringstream text;
  EXPECT_THROW(WriteCsv(system->description(), trajectory, 1000000, &text), BudgetExceeded);
}

TEST_F(SamplesTest, BothEndsOfEveryArcAreThere) {
  const Samples s = SampleTrajectory(trajectory, 11);
  ASSERT_EQ(s.first_of_arc.size(), trajectory.arcs.size() + 1);
  EXPECT_EQ(s.first_of_arc.back(), static_cast<int>(s.t.size()));
  EXPECT_EQ(s.x.rows(), static_cast<int>(s.t.size()));
  for (std::size_t k = 0; k < trajectory.arcs.size(); ++k) {
    const Arc& arc = trajectory.arcs[k];
    const int first = s.first_of_arc[k];
    const int last = s.first_of_arc[k + 1] - 1;
    EXPECT_EQ(s.t[static_cast<std::size_t>(first)], arc.t_begin);
    EXPECT_EQ(s.t[static_cast<std::size_t>(last)], arc.t_end);
    EXPECT_EQ(Vector(s.x.row(first)), arc.x_begin);
    EXPECT_EQ(Vector(s.x.row(last)), arc.x_end);
  }
}

TEST_F(SamplesTest, TimeNeverDecreasesAndOnlyRepeatsAtEvents) {
  const Samples s = SampleTrajectory(trajectory, 101);
  int repeats = 0;
  for (std::size_t i = 1; i < s.t.size(); ++i) {
    EXPECT_LE(s.t[i - 1], s.t[i]);
    repeats += s.t[i - 1] == s.t[i];
  }
  EXPECT_EQ(repeats, static_cast<int>(trajectory.transitions.size()));
  // 99 inner points of the grid, and two ends for each arc (no event falls on the grid here).
  EXPECT_EQ(s.t.size(), 99 + 2 * trajectory.arcs.size());
}

TEST_F(SamplesTest, OneSampleMeansTheEndsOnly) {
  EXPECT_EQ(SampleTrajectory(trajectory, 1).t.size(), 2 * trajectory.arcs.size());
}

TEST_F(SamplesTest, CsvKeepsEveryBit) {
  std::ostringstream out;
  WriteCsv(system->description(), trajectory, 5, &out);
  std::istringstream in(out.str());
  std::string line;
  ASSERT_TRUE(std::getline(in, line));
  EXPECT_EQ(line, "t [s],mode,x [m],y [m],d/dt x [m/s],d/dt y [m/s]");
  std::string last;
  std::size_t lines = 0;
  for (; std::getline(in, line); ++lines) last = line;
  EXPECT_EQ(lines, SampleTrajectory(trajectory, 5).t.size());
  // time,{…},x,y,vx,vy: the numbers after the mode.
  std::istringstream fields(last.substr(last.find("},") + 2));
  for (Eigen::Index i = 0; i < 4; ++i) {
    std::string field;
    ASSERT_TRUE(std::getline(fields, field, ','));
    EXPECT_EQ(std::strtod(field.c_str(), nullptr), trajectory.FinalState()(i));
  }
}

TEST(Csv, RatesHaveTheUnitsOfWhatMoves) {
  const auto system = LoadRobot(RobotFile("quadruped"));
  const NominalRun& drop = system->nominal();
  std::ostringstream out;
  WriteCsv(system->description(), Simulate(*system, drop.x, drop.u, 0.001), 1, &out);
  const std::string head = out.str().substr(0, out.str().find('\n'));
  for (const char* rate : {"base_x [m/s]", "base_wx [rad/s]", "front_left_knee [rad/s]"}) {
    EXPECT_NE(head.find(std::string(",d/dt ") + rate), std::string::npos) << rate;
  }
}

TEST(Csv, NamesAreQuoted) {
  const auto system = MakeModel("bouncing_ball");
  SystemDescription named = system->description();
  named.coordinates[0] = named.velocities[0] = "leg, left";
  named.constraints[0] = "foot \"a\"";
  std::ostringstream out;
  WriteCsv(named, Simulate(*system, system->nominal().x, Vector(0), 0.1), 1, &out);
  EXPECT_EQ(out.str().find("t [s],mode,\"leg, left ["), 0u) << out.str();
  EXPECT_NE(out.str().find(",\"d/dt leg, left [m/s]\""), std::string::npos) << out.str();
}

}  // namespace
}  // namespace contact_flow
