// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "contact_flow/piecewise_linear/map_consistency.h"

namespace contact_flow {
namespace test {

/// What is claimed must be seen at w. Linear programs hold constraints to 1e-8.
inline void ExpectWitness(const PiecewiseLinearMap& map, const MapConsistency& found) {
  ASSERT_EQ(map.cols(), found.w.size()) << found.message;
  EXPECT_NEAR(1, found.w.cwiseAbs().maxCoeff(), 1e-12);
  const auto unit_margin = [&](std::size_t k) {
    double margin = std::numeric_limits<double>::infinity();
    const Matrix& cone = map.pieces()[k].cone;
    for (Eigen::Index r = 0; r < cone.rows(); ++r) {
      if (cone.row(r).norm() > 0)
        margin = std::min(margin, cone.row(r).dot(found.w) / cone.row(r).norm());
    }
    return margin;
  };
  if (found.defect == MapDefect::kGap) {
    double nearest = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < map.pieces().size(); ++k)
      nearest = std::max(nearest, unit_margin(k));
    EXPECT_LT(nearest, 0) << found.message;
    EXPECT_NEAR(found.size, -nearest, 1e-12);
    return;
  }
  ASSERT_TRUE(found.first >= 0 && found.second >= 0) << found.message;
  EXPECT_GE(unit_margin(static_cast<std::size_t>(found.first)), -2e-8) << found.message;
  EXPECT_GE(unit_margin(static_cast<std::size_t>(found.second)), -2e-7) << found.message;
  const Vector jump = (map.pieces()[static_cast<std::size_t>(found.first)].matrix -
                       map.pieces()[static_cast<std::size_t>(found.second)].matrix) *
                      found.w;
  Vector scale = Vector::Zero(map.rows());
  for (const LinearPiece& piece : map.pieces()) {
    scale = scale.cwiseMax(piece.matrix.cwiseAbs().rowwise().sum());
  }
  EXPECT_NEAR(found.size, jump.cwiseQuotient(scale.cwiseMax(1e-300)).cwiseAbs().maxCoeff(),
              1e-12 + 1e-9 * found.size)
      << found.message;
}

inline void ExpectDefect(MapDefect defect, const PiecewiseLinearMap& map, const char* what) {
  const MapConsistency found = CheckConsistency(map);
  EXPECT_EQ(defect, found.defect) << what << ": " << found.message;
  EXPECT_FALSE(found.usable);
  ExpectWitness(map, found);
}

}  // namespace test
}  // namespace contact_flow
