// SPDX-License-Identifier: BSD-3-Clause
// Policies as YAML: read again they are the same to the bit, what is damaged is refused by name.
#include "contact_flow/io/policy_file.h"

#include <gtest/gtest.h>

#include <limits>
#include <sstream>
#include <string>
#include <utility>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/configuration_factors.h"
#include "contact_flow/model/model_library.h"
#include "test/refusal.h"

namespace contact_flow {
namespace {

TrackingPolicy PolicyOf(const std::string& model, double duration) {
  const auto system = MakeModel(model);
  const NominalRun& nominal = system->nominal();
  InputSchedule inputs;
  for (int k = 0; k < 5; ++k) {
    inputs.grid.push_back(duration * k / 5);
    inputs.values.push_back(nominal.u + Vector::Constant(nominal.u.size(), 0.01 * k / 3));
  }
  const TrackingWeights weights = {Vector::Ones(2 * system->dof()),
                                   Vector::Ones(system->num_inputs()),
                                   Vector::Constant(2 * system->dof(), 10)};
  TrackingPolicy policy =
      MakePolicy(*system, Simulate(*system, nominal.x, inputs, duration), inputs, 0.02, weights);
  policy.lower = Vector::Constant(nominal.u.size(), -0.1);
  policy.upper = Vector::Constant(nominal.u.size(), 1.0 / 3);
  return policy;
}

std::string Written(const TrackingPolicy& policy) {
  std::ostringstream out;
  WritePolicy(policy, &out);
  return out.str();
}

void ExpectSame(const TrackingPolicy& one, const TrackingPolicy& other) {
  EXPECT_EQ(one.names.model, other.names.model);
  EXPECT_EQ(one.names.coordinates, other.names.coordinates);
  EXPECT_EQ(one.names.units, other.names.units);
  EXPECT_EQ(one.names.velocities, other.names.velocities);
  EXPECT_EQ(one.names.constraints, other.names.constraints);
  EXPECT_EQ(one.names.inputs, other.names.inputs);
  EXPECT_EQ(FactorNames(one.reference.space()), FactorNames(other.reference.space()));
  EXPECT_EQ(one.reference.inputs().grid, other.reference.inputs().grid);
  EXPECT_EQ(one.reference.inputs().values, other.reference.inputs().values);
  EXPECT_EQ(one.gains, other.gains);
  EXPECT_EQ(one.gain_phases, other.gain_phases);
  EXPECT_EQ(one.kinked, other.kinked);
  EXPECT_EQ(one.lower, other.lower);
  EXPECT_EQ(one.upper, other.upper);
  ASSERT_EQ(one.reference.phases().size(), other.reference.phases().size());
  for (std::size_t k = 0; k < one.reference.phases().size(); ++k) {
    const ReferencePhase &a = one.reference.phases()[k], &b = other.reference.phases()[k];
    EXPECT_EQ(a.mode, b.mode);
    EXPECT_EQ(a.t_begin, b.t_begin);
    EXPECT_EQ(a.t_end, b.t_end);
    EXPECT_EQ(a.x_begin, b.x_begin);
    EXPECT_EQ(a.x_end, b.x_end);
    EXPECT_EQ(a.activated, b.activated);
    EXPECT_EQ(a.released, b.released);
    EXPECT_EQ(a.t, b.t);
    EXPECT_EQ(a.x, b.x);
    EXPECT_EQ(a.a, b.a);
  }
}

/// With bounces; with a unit quaternion and eight corners; with friction and its letters.
TEST(PolicyFile, RoundTripToTheBit) {
  for (const auto& [model, duration] : {std::pair<const char*, double>{"driven_ball", 1.2},
                                        {"falling_box", 0.3},
                                        {"block_on_incline", 0.4}}) {
    SCOPED_TRACE(model);
    const TrackingPolicy policy = PolicyOf(model, duration);
    const std::string text = Written(policy);
    const TrackingPolicy again = ReadPolicy(text, "policy");
    ExpectSame(policy, again);
    EXPECT_EQ(text, Written(again));
  }
  EXPECT_GT(PolicyOf("driven_ball", 1.2).reference.phases().size(), 1u);
}

/// Of one input the upper bound alone, of the other none.
TEST(PolicyFile, BoundsMayBeOfSomeInputsAlone) {
  const double none = std::numeric_limits<double>::infinity();
  TrackingPolicy policy = PolicyOf("double_pendulum", 0.3);
  policy.lower = Eigen::Vector2d(-none, -none);
  policy.upper = Eigen::Vector2d(3, none);
  const std::string text = Written(policy);
  ExpectSame(policy, ReadPolicy(text, "policy"));
  policy.upper(0) = -none;
  EXPECT_THROW(CheckPolicy(policy), std::invalid_argument);
}

std::string PolicyRefusal(const std::string& text) {
  return test::RefusalOf([&] { ReadPolicy(text, "a.yaml"); });
}

/// Each damage with words that its refusal must have.
TEST(PolicyFile, DamagedPoliciesAreRefusedByName) {
  const std::string text = Written(PolicyOf("driven_ball", 1.2));
  const auto damaged = [&text](const std::string& from, const std::string& to) {
    std::string other = text;
    const std::size_t at = other.find(from);
    EXPECT_NE(std::string::npos, at) << from;
    return other.replace(at, from.size(), to);
  };
  const std::string grid =
      text.substr(text.find("grid: "), text.find('\n', text.find("grid: ")) - text.find("grid: "));
  const struct {
    std::string text, words[2];
  } cases[] = {
      {damaged("contact_flow_policy: 1", "contact_flow_policy: 2"), {"contact_flow_policy", "2"}},
      {damaged("contact_flow_policy: 1\n", ""), {"contact_flow_policy", "a.yaml"}},
      {damaged("grid", "grit"), {"grid", ""}},
      {damaged(grid, "grid: [0, 0.1, 0.2, 0.3]"), {"feed_forward", "4"}},
      {damaged(grid, "grid: [0, 0.1, 0.2, 0.2, 0.3]"), {"grid[3]", "0.2"}},
      {damaged(grid, "grid: [0, 0.1, 0.2, .nan, 0.3]"), {"grid[3]", ".nan"}},
      {damaged("factors: [\"line\"]", "factors: [\"lin\"]"), {"factors[0]", "'line'"}},
      {damaged("factors: [\"line\"]", "factors: []"), {"states", "multiple of 0"}},
      {damaged("coordinates: [\"z\"]", "coordinates: [\"z\", \"y\"]"), {"coordinates", "2"}},
      {damaged("inputs: [\"", "inputs: [\"more\", \""), {"feed_forward", "multiple of 2"}},
      {damaged("constraints: [\"floor\"]", "constraints: [\"flor\"]"),
       {"phases[0]/activated[0]", "'floor'"}},
      {damaged("- mode: \"o\"", "- mode: \"x\""), {"phases[0]/mode", "'x'"}},
      {damaged("- mode: \"o\"", "- mode: \"oo\""), {"phases[0]/mode", "'oo'"}},
      {damaged("t_begin: 0", "t_begin: 0.0005"), {"phases[0].x_begin", "0.0005"}},
      {damaged("x_begin: [", "x_begin: [1"), {"phases[0].x_begin", "table"}},
      {damaged("  times: [0, ", "  times: [0.1, "), {"phases[0].times[1]", "earlier"}},
      {damaged("- phase: 0", "- phase: 7"), {"gain_phases[0]", "7"}},
      {damaged("kinked: false", "kinked: maybe"), {"gains[0]/kinked", "'maybe'"}},
      {damaged("rows: [", "rows: [1, "), {"gains[0]/rows", "3"}},
      {damaged("rows: [", "rows: [1e300, 1, "), {"gains[0]/rows[0]", "1e300"}},
      {damaged("lower: [-", "lower: ["), {"", ""}},  // 0.1 ≤ 1/3: in order
      {damaged("lower: [-0.1", "lower: [0.5"), {"lower[0]", "0.5"}},
      {damaged("lower: [-0.1", "lower: [.inf"), {"lower[0]", "'.inf"}},
      {text + "more: 1\n", {"more", ""}},
      {"", {"contact_flow_policy", ""}},
      {"[", {"a.yaml", ""}},
  };
  for (const auto& damage : cases) {
    const std::string message = PolicyRefusal(damage.text);
    if (damage.words[0].empty()) {
      EXPECT_EQ("", message);
      continue;
    }
    for (const std::string& word : damage.words) {
      EXPECT_NE(std::string::npos, message.find(word)) << word << " is not in: " << message;
    }
  }
}

TEST(ConfigurationFactors, AndBack) {
  ConfigurationSpace space;
  space.Append(ConfigurationSpace::Factor::kLine, 3)
      .Append(ConfigurationSpace::Factor::kRotation)
      .Append(ConfigurationSpace::Factor::kCircle, 2)
      .Append(ConfigurationSpace::Factor::kLine);
  const std::vector<std::string> names = {"line",   "line",   "line", "rotation",
                                          "circle", "circle", "line"};
  EXPECT_EQ(names, FactorNames(space));
  EXPECT_EQ(names, FactorNames(SpaceOfFactors("factors", names)));
  EXPECT_THROW(SpaceOfFactors("factors", {"line", "sphere"}), std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
