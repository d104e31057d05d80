// SPDX-License-Identifier: BSD-3-Clause
#include "src/derivative/decayed_defect.h"

#include <gtest/gtest.h>

namespace contact_flow {
namespace {

/// One mode that decays, turned out of the axes, and one that nothing damps: by closed form what is
/// left is δ/(1 + h r)² of the first, and all of the second; what K is does not matter.
TEST(DecayedDefect, IsWhatEachModeLeaves) {
  const double h = 0.3;
  const Eigen::Vector2d decays(0.6, 0.8), stays(-0.8, 0.6);
  for (const double r : {1e-3, 1.0, 1e3, 1e9}) {
    Matrix jacobian(2, 5);
    jacobian << Matrix::Constant(2, 2, 7), -r * decays * decays.transpose(), Vector::Ones(2);
    DecayedDefect decayed;
    decayed.At(jacobian, h);
    Matrix defect(2, 2);
    defect << decays, stays;
    decayed.Apply(&defect);
    const double left = 1 / ((1 + h * r) * (1 + h * r));
    EXPECT_LT((defect.col(0) - left * decays).norm(), 1e-12 * left + 1e-15) << r;
    EXPECT_LT((defect.col(1) - stays).norm(), 1e-6) << r;
  }
}

}  // namespace
}  // namespace contact_flow
