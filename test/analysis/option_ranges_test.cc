// SPDX-License-Identifier: BSD-3-Clause
// Options out of their range prove nothing: they are refused.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "contact_flow/piecewise_linear/covariance.h"
#include "contact_flow/piecewise_linear/descent.h"
#include "contact_flow/piecewise_linear/stability.h"

namespace contact_flow {
namespace {

PiecewiseLinearMap Times(double factor) {
  return PiecewiseLinearMap::Linear(Matrix::Constant(1, 1, factor));
}

TEST(StabilityOptions, OutOfTheirRangeAreRefused) {
  for (double margin : {-5.0, 1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    StabilityOptions options;
    options.margin = margin;
    // With −5 doubling would be stable, with NaN halving unstable.
    EXPECT_THROW(AssessStability(Times(2), options), std::invalid_argument) << margin;
    EXPECT_THROW(AssessStability(Times(0.5), options), std::invalid_argument) << margin;
    StabilityCertificate certificate;
    certificate.test = StabilityTest::kNormOne;
    certificate.bound = 2;
    EXPECT_THROW(VerifyCertificate(Times(2), certificate, options), std::invalid_argument);
  }
  StabilityOptions few;
  few.max_words = -1;
  EXPECT_THROW(AssessStability(Times(2), few), std::invalid_argument);
  few = {};
  few.max_word_length = 0;
  EXPECT_THROW(AssessStability(Times(2), few), std::invalid_argument);
  few = {};
  few.max_linear_programs = -1;
  EXPECT_THROW(WorstGain(Times(2), 1, few), std::invalid_argument);
  few = {};
  few.margin = 0;
  EXPECT_EQ(StabilityVerdict::kStable, AssessStability(Times(0.5), few).verdict);
  EXPECT_EQ(StabilityVerdict::kUnstable, AssessStability(Times(2), few).verdict);
}

TEST(CovarianceOptions, NeedARotation) {
  CovarianceOptions options;
  options.rotations = 0;
  EXPECT_THROW(PropagateCovariance(Times(1), Matrix::Identity(1, 1), options),
               std::invalid_argument);
}

TEST(DescentOptions, OutOfTheirRangeAreRefused) {
  const NonsmoothCost cost = [](const VectorRef&, CostQuery) { return CostValue(); };
  for (double bad : {-1.0, std::nan("")}) {
    DescentOptions options;
    options.radius = bad;
    EXPECT_THROW(Minimize(cost, Vector::Zero(1), options), std::invalid_argument);
    options = {};
    options.tolerance = bad;
    EXPECT_THROW(Minimize(cost, Vector::Zero(1), options), std::invalid_argument);
  }
}

}  // namespace
}  // namespace contact_flow
