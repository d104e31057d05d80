// SPDX-License-Identifier: BSD-3-Clause
// A policy in the loop: messages that come in another order than they were sent, times that go
// back, messages of another model; policies as messages, to the bit; a robot's state by standard
// topics, as one.
#include "src/ros/policy/policy_loop.h"

#include <gtest/gtest.h>
#include <ros/time.h>

#include <cmath>
#include <functional>
#include <limits>
#include <sstream>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/policy_file.h"
#include "contact_flow/model/model_library.h"
#include "src/ros/policy/robot_topics.h"
#include "src/ros/request/policy_messages.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kGravity = 9.8;
const double kHit = std::sqrt(2 / kGravity);

/// A ball falls from 1 m and bounces.
TrackingPolicy BallPolicy() {
  const auto ball = MakeModel("driven_ball");
  InputSchedule inputs;
  for (int k = 0; k < 4; ++k) {
    inputs.grid.push_back(0.2 * k);
    inputs.values.push_back(Vector::Zero(1));
  }
  return MakePolicy(*ball, Simulate(*ball, Eigen::Vector2d(1, 0), inputs, 0.8), inputs, 0.1,
                    {Vector::Ones(2), Vector::Ones(1), Vector::Ones(2)});
}

HybridState StateAt(double t, double z, double v, std::uint64_t events) {
  HybridState m;
  m.t = t;
  m.events = events;
  m.coordinates = m.velocities = {"z"};
  m.constraints = {"floor"};
  m.inputs = {"force"};
  m.q = {z};
  m.v = {v};
  return m;
}

SimulatorEvent TouchdownAt(double t, std::uint64_t index) {
  SimulatorEvent m;
  m.index = index;
  m.constraints = {"floor"};
  m.transition.t = t;
  m.transition.activated = {"floor"};
  return m;
}

PolicyLoop Loop() {
  return PolicyLoop(BallPolicy(), TrackerOptions(), std::numeric_limits<double>::quiet_NaN());
}

TEST(PolicyLoop, StatesWaitForTheEventsBeforeThem) {
  PolicyLoop loop = Loop();
  EXPECT_TRUE(loop.Take(StateAt(3, 1, 0, 7)).step);  // begins here
  const double late = 3 + kHit + 0.02;
  // Behind a touchdown that has not been heard of yet …
  EXPECT_FALSE(loop.Take(StateAt(late + 0.001, 0.003, 3, 8)).step);
  const PolicyAnswer answer = loop.Take(TouchdownAt(late, 8));
  ASSERT_TRUE(answer.step);
  EXPECT_EQ(1u, answer.step->phase);
  EXPECT_NEAR(kHit + 0.021, answer.step->t, 1e-12);
  ASSERT_EQ(1u, answer.events.size());
  EXPECT_EQ("late", answer.events[0].kind);
  EXPECT_NEAR(kHit + 0.02, answer.events[0].t, 1e-9);
  EXPECT_NEAR(kHit, answer.events[0].expected, 1e-8);
  EXPECT_EQ(std::vector<std::string>{"floor"}, answer.events[0].constraints);
  // … and an event that is heard of before the states that it comes behind.
  EXPECT_FALSE(loop.Take(TouchdownAt(late + 0.1, 9)).step);
  const PolicyAnswer before = loop.Take(StateAt(late + 0.002, 0.006, 3, 8));
  EXPECT_TRUE(before.step && before.events.empty());
  const PolicyAnswer behind = loop.Take(StateAt(late + 0.101, 0.006, 3, 9));
  ASSERT_TRUE(behind.step);
  ASSERT_EQ(1u, behind.events.size());
  EXPECT_EQ("extra", behind.events[0].kind);
  EXPECT_TRUE(std::isnan(behind.events[0].expected));
}

TEST(PolicyLoop, EventsThatNeverComeAreGivenUp) {
  ros::Time::init();  // of the warning
  PolicyLoop loop = Loop();
  loop.Take(StateAt(0, 1, 0, 0));
  int waited = 0;
  while (!loop.Take(StateAt(0.001 * (waited + 1), 1, 0, 1)).step) ASSERT_LT(++waited, 1000);
  EXPECT_GT(waited, 10);
  EXPECT_TRUE(loop.Take(StateAt(0.5, 1, 0, 1)).step);
}

TEST(PolicyLoop, EventsWithoutStatesAreForgotten) {
  PolicyLoop loop = Loop();
  loop.Take(StateAt(0, 1, 0, 0));
  constexpr std::uint64_t kMany = 10100;
  for (std::uint64_t k = 1; k <= kMany; ++k) loop.Take(TouchdownAt(0.3, k));
  EXPECT_EQ(10000u, loop.Take(StateAt(0.31, 0.5, -2, kMany)).events.size());
}

TEST(PolicyLoop, BeginsAnewWhenTimeGoesBackAndEndsWithTheReference) {
  PolicyLoop loop = Loop();
  loop.Take(StateAt(0, 1, 0, 0));
  loop.Take(TouchdownAt(kHit, 1));
  EXPECT_EQ(1u, loop.Take(StateAt(0.5, 0.1, 3, 1)).step->phase);
  EXPECT_FALSE(loop.Take(StateAt(0.9, 0.1, 3, 1)).step);
  EXPECT_TRUE(loop.over());
  const PolicyAnswer again = loop.Take(StateAt(0.1, 0.95, -1, 0));
  ASSERT_TRUE(again.step);
  EXPECT_FALSE(loop.over());
  EXPECT_EQ(0u, again.step->phase);
  EXPECT_EQ(0, again.step->t);
  loop.Restart();
  EXPECT_EQ(0, loop.Take(StateAt(0.4, 0.95, -1, 0)).step->t);
}

/// What is solved on the side is followed from its begin on, unless the policy has begun anew.
TEST(PolicyLoop, GoesOverToWhatIsSolved) {
  const std::shared_ptr<const MechanicalSystem> ball = MakeModel("driven_ball");
  HorizonProblem problem =
      FollowReference(BallPolicy(), Vector::Ones(1), Vector::Ones(1), Vector::Ones(2), 0);
  HorizonOptions options;
  options.weights = {Vector::Ones(2), Vector::Ones(1), Vector::Ones(2)};
  options.budget = 1000;
  PolicyLoop loop = Loop();
  EXPECT_FALSE(loop.Task(0.05));
  loop.Take(StateAt(3, 1.1, 0, 0));
  const auto first = loop.Task(0.05);
  ASSERT_TRUE(first);
  EXPECT_EQ(0, first->task.t);
  EXPECT_EQ(0.05, first->task.begin);
  EXPECT_FALSE(loop.Task(2));  // behind its end
  loop.Restart();
  loop.Take(StateAt(4, 1.1, 0, 0));
  const HorizonSolution solution = SolveHorizon(ball, problem, options, first->task);
  ASSERT_NE(nullptr, solution.policy) << solution.message;
  loop.Offer(solution, first->number);  // of before
  const PolicyAnswer own = loop.Take(StateAt(4.06, 1.1, -0.6, 0));
  EXPECT_TRUE(own.solves.empty());
  const auto second = loop.Task(0.05);
  ASSERT_TRUE(second);
  loop.Offer(SolveHorizon(ball, problem, options, second->task), second->number);
  EXPECT_TRUE(loop.Take(StateAt(4.1, 1.05, -1, 0)).solves.empty());
  EXPECT_FALSE(loop.Task(0.05));  // one waits
  const PolicyAnswer answer = loop.Take(StateAt(4.12, 1.03, -1.2, 0));
  ASSERT_EQ(1u, answer.solves.size());
  EXPECT_TRUE(loop.Task(0.05));
  EXPECT_EQ("solved", answer.solves[0].verdict) << answer.solves[0].message;
  EXPECT_TRUE(answer.solves[0].followed);
  EXPECT_NEAR(0.11, answer.solves[0].begin, 1e-12);
  // Beside the reference of its own, which begins where the ball was to be.
  EXPECT_LT(std::abs(answer.step->error[0]), 0.03);
  EXPECT_GT(std::abs(own.step->error[0]), 0.09);
}

TEST(PolicyLoop, MessagesOfAnotherModelAreRefused) {
  PolicyLoop loop = Loop();
  HybridState state = StateAt(0, 1, 0, 0);
  state.inputs = {"torque"};
  EXPECT_THROW(loop.Take(state), std::invalid_argument);
  state = StateAt(0, 1, 0, 0);
  state.v.clear();
  EXPECT_THROW(loop.Take(state), std::invalid_argument);
  state = StateAt(0, std::nan(""), 0, 0);
  EXPECT_THROW(loop.Take(state), std::invalid_argument);
  SimulatorEvent event = TouchdownAt(0, 1);
  event.constraints = {"wall"};
  EXPECT_THROW(loop.Take(event), std::invalid_argument);
}

std::string Text(const TrackingPolicy& policy) {
  std::ostringstream out;
  WritePolicy(policy, &out);
  return out.str();
}

/// The file has everything, to the bit (policy_file_test).
TEST(PolicyMessage, RoundTripToTheBit) {
  TrackingPolicy policy = BallPolicy();
  policy.lower = Vector::Constant(1, -1.0 / 3);
  policy.kinked = {1, 3};
  EXPECT_EQ(Text(policy), Text(FromMsg(ToMsg(policy))));
  const auto box = MakeModel("falling_box");
  const InputSchedule inputs = InputSchedule::Constant(box->nominal().u);
  const TrackingPolicy spatial =
      MakePolicy(*box, Simulate(*box, box->nominal().x, inputs, 0.3), inputs, 0.01,
                 {Vector::Ones(12), Vector::Ones(6), Vector::Ones(12)});
  EXPECT_EQ(Text(spatial), Text(FromMsg(ToMsg(spatial))));
}

TEST(PolicyMessage, DamagedOnesAreRefusedByName) {
  const Policy good = ToMsg(BallPolicy());
  const struct {
    std::function<void(Policy*)> damage;
    const char* word;
  } cases[] = {
      {[](Policy* m) { m->phases[1].q_begin.clear(); }, "phases[1].q_begin"},
      {[](Policy* m) { m->phases[0].mode_word = "oo"; }, "phases[0].mode_word is 'oo'"},
      {[](Policy* m) { m->phases[0].mode = {"floor"}; }, "phases[0].mode is {floor}"},
      {[](Policy* m) { m->phases[0].activated = {"flor"}; }, "'flor'"},
      {[](Policy* m) { m->phases[0].q.data.pop_back(); }, "q.data"},
      {[](Policy* m) { m->phases[1].a.data[3] = std::nan(""); }, "phases[1].a.data[3]"},
      {[](Policy* m) { m->phases.clear(); }, "phases is empty"},
      {[](Policy* m) { m->gains[2].phase = 4000000000u; }, "gain_phases[2]"},
      {[](Policy* m) { m->gains[0].K.cols = 1; }, "gains[0].K"},
      {[](Policy* m) { m->gains.clear(); }, "number of gains is 0"},
      {[](Policy* m) { m->factors = {"sphere"}; }, "factors[0]"},
      {[](Policy* m) { m->feed_forward.times.pop_back(); }, "feed_forward"},
      {[](Policy* m) { m->inputs.clear(); }, "inputs is empty"},
  };
  for (const auto& entry : cases) {
    Policy bad = good;
    entry.damage(&bad);
    try {
      FromMsg(bad);
      ADD_FAILURE() << entry.word;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find(entry.word)) << error.what();
    }
  }
}

TEST(RobotTopics, JointsAndOdometryOfOneStampAreAState) {
  PolicyNames names;
  names.coordinates = names.velocities = {"base_x", "base_z", "base_pitch", "knee"};
  names.constraints = {"left", "right"};
  RobotTopics robot(names, 2);
  ASSERT_TRUE(robot.has_base());
  sensor_msgs::JointState joints;
  joints.name = {"other", "knee"};
  joints.position = {9, 0.5};
  joints.velocity = {9, -0.25};
  joints.header.stamp.fromSec(10);
  EXPECT_FALSE(robot.Take(joints));
  // Pitched by 0.6 rad about y; 2 m/s along its own axis x, 1 rad/s about y.
  nav_msgs::Odometry odometry;
  odometry.header.stamp.fromSec(10);
  odometry.pose.pose.position.x = 3;
  odometry.pose.pose.position.z = 0.8;
  odometry.pose.pose.orientation.y = std::sin(0.3);
  odometry.pose.pose.orientation.w = std::cos(0.3);
  odometry.twist.twist.linear.x = 2;
  odometry.twist.twist.angular.y = 1;
  geometry_msgs::WrenchStamped wrench;
  wrench.wrench.force.z = 3;
  robot.Take(1, wrench);
  const auto state = robot.Take(odometry);
  ASSERT_TRUE(state);
  Vector expected(8);
  expected << 3, 0.8, 0.6, 0.5, 2 * std::cos(0.6), -2 * std::sin(0.6), 1, -0.25;
  EXPECT_LT((state->x - expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(ConstraintSet{1}, state->activated);
  EXPECT_TRUE(state->released.Empty());
  wrench.wrench.force.z = 1;
  robot.Take(1, wrench);
  joints.header.stamp.fromSec(10);
  EXPECT_EQ(ConstraintSet{1}, robot.Take(joints)->released);
  joints.header.stamp.fromSec(11);  // odometry of another clock: with the latest one
  EXPECT_FALSE(robot.Take(joints));
  joints.header.stamp.fromSec(12);
  ASSERT_TRUE(robot.Take(joints));
  joints.header.stamp.fromSec(10);
  joints.name = {"knees", "others"};
  RobotTopics fresh(names, 2);
  fresh.Take(odometry);
  EXPECT_THROW(fresh.Take(joints), std::invalid_argument);
  odometry.pose.pose.orientation.w = 0;
  EXPECT_THROW(fresh.Take(odometry), std::invalid_argument);
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
