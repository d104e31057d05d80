// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// One linear selection of a piecewise-linear map: w ↦ matrix·w on the cone {w : cone·w ≥ 0}.
struct LinearPiece {
  Matrix matrix;  ///< [rows×cols]
  Matrix cone;    ///< half-spaces, one unit normal a row [h×cols]; no row: the whole space
  /// ω: the order of activations that selects this piece, one entry a simultaneous cluster, each
  /// naming the constraints in the order in which they are met.
  std::vector<std::vector<std::string>> omega;
  /// η: the contact modes passed through, from the first arc to the last, "{}"-style strings.
  std::vector<std::string> eta;
  /// Their words, one letter a constraint (ContactMode::Word).
  std::vector<std::string> words;

  /// Smallest cone·w; ≥ 0 inside (+∞ for the whole space).
  double Margin(const VectorRef& w) const;
};

/// A continuous, positively homogeneous map ℝᶜ → ℝʳ that is linear on each of finitely many cones:
/// the form of every B-derivative (Theorem 1). Closed under composition.
class PiecewiseLinearMap {
 public:
  PiecewiseLinearMap() = default;
  /// The map of these pieces, whose cones cover the space.
  explicit PiecewiseLinearMap(std::vector<LinearPiece> pieces);
  /// One matrix for all arguments.
  static PiecewiseLinearMap Linear(const Matrix& matrix);

  /// The matrices with their cones.
  const std::vector<LinearPiece>& pieces() const { return pieces_; }
  /// Length of a value.
  int rows() const { return static_cast<int>(pieces_.front().matrix.rows()); }
  /// Length of an argument.
  int cols() const { return static_cast<int>(pieces_.front().matrix.cols()); }
  /// Whether there is one piece alone.
  bool IsLinear() const { return pieces_.size() == 1; }

  /// The value at w: by the piece whose cone holds w best (on a shared face any gives the same).
  Vector operator()(const VectorRef& w) const;
  /// Index of that piece.
  int PieceAt(const VectorRef& w) const;

  /// this ∘ inner. A word of pieces is kept when its cone has interior (a linear program); without
  /// the linear-programming library every word is kept. Throws std::length_error
  /// beyond `max_pieces`.
  PiecewiseLinearMap After(const PiecewiseLinearMap& inner, std::size_t max_pieces = 100000) const;

  /// Largest entry of |A_i − A_1| over the pieces: 0 when the map is linear after all (C¹).
  double Kink() const;

 private:
  std::vector<LinearPiece> pieces_;
};

/// Throws std::invalid_argument for a map without a row or without a column.
void RequireEntries(const PiecewiseLinearMap& map);

}  // namespace contact_flow
