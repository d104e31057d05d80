// SPDX-License-Identifier: BSD-3-Clause
// Why directions are not admitted: what leads out of the domain, and what goes against a slip that
// begins, are told apart.
#include "contact_flow/ros/directions.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "contact_flow/CovarianceRequest.h"
#include "contact_flow/DerivativeRequest.h"
#include "contact_flow/ros/answers.h"
#include "contact_flow/ros/covariance_answer.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using Model = ros_interface::Setup;  // testing::Test has a Setup of its own

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

TEST(Directions, AgainstABeginningSlipSaySo) {
  const Model setup = SteepBlock();
  auto request = AtRest<DerivativeRequest>();
  request.directions = {"+d/dt x"};
  EXPECT_EQ(Refusal(setup, request), "");
  request.directions = {"-d/dt x"};
  EXPECT_EQ(Refusal(setup, request),
            "direction -d/dt x moves the contact 'floor', which begins to slip at the start, "
            "against that slip: how it is reversed is not followed");
}

TEST(Directions, AgainstABeginningSlipAreLeftOutOfThoseNotAskedFor) {
  const Model setup = SteepBlock();
  const OutcomeDerivative result = Answer(setup, AtRest<DerivativeRequest>());
  EXPECT_EQ(result.outcome, 0) << result.message;
  bool told = false;
  for (const ResultWarning& warning : result.warnings) {
    told = told || warning.message ==
                       "left out, because they move contacts that begin to slip against that slip, "
                       "and how it is reversed is not followed: -d/dt x ('floor')";
    EXPECT_EQ(warning.message.find("lead through"), std::string::npos) << warning.message;
  }
  EXPECT_TRUE(told);
}

TEST(Directions, ACovarianceAgainstABeginningSlipSaysSo) {
  const Model setup = SteepBlock();
  auto request = AtRest<CovarianceRequest>();
  request.deviations = {0, 0, 0, 0.1, 0, 0};
  EXPECT_EQ(Refusal(setup, request),
            "the covariance moves the contact 'floor', which begins to slip at the start, against "
            "that slip: how it is reversed is not followed");
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
