// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <random>
#include <vector>

#include "frictional_walk.h"

namespace contact_flow {

/// All ways through a cluster with friction, from cone to cone, until their cones cover all
/// directions w = S N z: S the sizes of entries, so that units do not count, N an orthonormal basis
/// of those that hold what the mode before holds. What cones leave over is found by linear
/// programs, and its middle followed. Without these, by rays and at random.
class PathSearch {
 public:
  /// The path along w, its decisions in `cone`; throws std::domain_error where that is not decided.
  using Follow = std::function<FrictionalPath(const Vector& w)>;

  PathSearch(Follow follow, Vector sizes, Matrix basis, std::size_t max_pieces);

  /// Throws std::length_error beyond `max_pieces`, std::domain_error like `follow`, and
  /// NotPiecewiseLinear where no cone is found in a part of the directions, or the cones do not
  /// tell the map.
  std::vector<FrictionalPath> Take();

 private:
  struct Piece {
    FrictionalPath path;
    Matrix rows;    ///< of its cone, by z, unit rows
    Matrix matrix;  ///< of w, in sizes
    Vector inside;  ///< z
  };

  Vector Draw();
  Piece PieceOf(const Vector& z) const;
  static bool Decided(const Piece& piece);
  int Holding(const Vector& z) const;
  void Cover(Matrix region);
  int Explore(const Vector& centre, double radius);
  int Add(Piece piece);
  void RayByRay();
  void Check();
  bool Alike(const Piece& a, const Piece& b) const;
  bool Unite(Piece* a, const Piece& b) const;
  void UniteAll();

  const Follow follow_;
  const Vector sizes_;
  const Matrix basis_;
  const std::size_t max_pieces_;
  std::vector<Piece> pieces_;
  std::mt19937 random_{20};
};

}  // namespace contact_flow
