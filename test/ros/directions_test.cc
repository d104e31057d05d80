// SPDX-License-Identifier: BSD-3-Clause
// Which directions are admitted, and why others are not.
#include "src/session/directions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "contact_flow/CovarianceRequest.h"
#include "contact_flow/DerivativeRequest.h"
#include "src/ros/answer/answers.h"
#include "src/ros/answer/covariance_answer.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using Model = contact_flow::Setup;  // testing::Test has a Setup of its own

/// At rest on its plane, which is so steep (tan 0.6 > 0.5) that it begins to slip down.
Setup SteepBlock() {
  Configuration configuration;
  configuration.model = "block_on_incline";
  configuration.parameters = {{"incline", 0.6}};
  return Setup(configuration);
}

template <class Request>
Request AtRest() {
  Request request;
  request.duration = 0.1;
  request.state.q = {0, 0, 0};
  request.state.v = {0, 0, 1};
  return request;
}

template <class Request>
std::string Refusal(const Setup& setup, const Request& request) {
  try {
    Answer(setup, request);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

/// Both sides of a slip that begins are answered, and the covariance by both pieces.
TEST(Directions, AgainstABeginningSlipAreFollowed) {
  const Model setup = SteepBlock();
  auto request = AtRest<DerivativeRequest>();
  request.directions = {"+d/dt x", "-d/dt x"};
  const OutcomeDerivative result = Answer(setup, request);
  EXPECT_EQ(result.outcome, 0) << result.message;
  EXPECT_TRUE(result.warnings.empty());
  ASSERT_EQ(result.derivatives.rows, 2u);
  // 1, and −(sin − μ cos)/(sin + μ cos).
  const double sine = std::sin(0.6), cosine = 0.5 * std::cos(0.6);
  EXPECT_NEAR(result.derivatives.data[3], 1, 1e-9);
  EXPECT_NEAR(result.derivatives.data[result.derivatives.cols + 3],
              -(sine - cosine) / (sine + cosine), 1e-9);
  auto spread = AtRest<CovarianceRequest>();
  spread.deviations = {0, 0, 0, 0.1, 0, 0};
  EXPECT_EQ(Refusal(setup, spread), "");
}

TEST(Directions, ThroughWhatTheStartTouchesSaySo) {
  Configuration configuration;
  configuration.model = "ball_in_corner";
  const Model setup(configuration);
  // On the floor and leaving it: not in the contact mode.
  DerivativeRequest request;
  request.duration = 0.01;
  request.state.names = {"y"};
  request.state.positions = {0};
  request.state.velocities = {1};
  request.directions = {"-y"};
  const std::string refusal = Refusal(setup, request);
  EXPECT_NE(refusal.find("direction -y leads through the constraint 'floor', which the "
                         "start touches"),
            std::string::npos)
      << refusal;
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
