// SPDX-License-Identifier: BSD-3-Clause
// How large something is, among what a gap is made of and among contacts that feel each other.
#include "src/dynamics/felt_contacts.h"

#include <gtest/gtest.h>

#include "src/dynamics/coordinate_reach.h"

namespace contact_flow {
namespace {

/// Contacts 0 and 2 feel each other by 1 alone; 3 is by itself.
TEST(FeltContacts, FeelThoseBehindOthers) {
  Matrix G = Matrix::Identity(4, 4);
  G(0, 1) = G(1, 0) = G(1, 2) = G(2, 1) = -0.1;
  const Matrix moved = Matrix::Identity(4, 4);
  const FeltContacts felt(G, moved);
  EXPECT_TRUE(felt.Feels(0, 2));
  EXPECT_FALSE(felt.Feels(2, 3));
  const Vector value = (Vector(4) << 1, -2, 5, -1e8).finished();
  for (int row = 0; row < 3; ++row) EXPECT_EQ(5, felt.Largest(row, value));
  EXPECT_EQ(1e8, felt.Largest(3, value));
}

/// A body far along x, above a floor: its gap, by z and by turns, does not know how far.
TEST(CoordinateReach, IsThatOfItsOwnCoordinates) {
  ConfigurationSpace space(3);
  space.Append(ConfigurationSpace::Factor::kRotation);
  const Vector q = (Vector(7) << -1e6, 0, 0.5, 1, 0, 0, 0).finished();
  EXPECT_EQ((Vector(6) << 1e6, 1, 1, 1, 1, 1).finished(), CoordinateReach(space, q));
  const Vector row = (Vector(6) << 0, 0, 1, 0, -0.2, 0.3).finished();
  EXPECT_DOUBLE_EQ(1.5, ReachAlong(row, space, q));
  EXPECT_DOUBLE_EQ(row.cwiseAbs().dot(CoordinateReach(space, q)), ReachAlong(row, space, q));
}

/// Of two lines, the one that is far hardly moves: the time is that of the other.
TEST(CoordinateReach, TheNearOneTellsTheTime) {
  const ConfigurationSpace space(2);
  const Vector x = (Vector(4) << 1e7, 0, 0, 3).finished();
  const Vector field = (Vector(4) << 0, 3, 9.81, 0).finished();
  EXPECT_DOUBLE_EQ(1 / 9.81, TimeToMove(space, x, field));
}

}  // namespace
}  // namespace contact_flow
