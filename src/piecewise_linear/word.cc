// SPDX-License-Identifier: BSD-3-Clause
#include "word.h"

#include <Eigen/LU>
#include <algorithm>

#include "contact_flow/piecewise_linear/linear_program.h"

namespace contact_flow {
namespace {

/// A half-space whose normal shrinks to this part under a linear map is the whole space.
constexpr double kVanished = 1e-12;

/// rows·matrix with unit rows, without rows that vanish.
Matrix PullBack(const Matrix& rows, const Matrix& matrix) {
  Matrix pulled = rows * matrix;
  const double scale = matrix.size() > 0 ? matrix.cwiseAbs().maxCoeff() : 0;
  Eigen::Index kept = 0;
  for (Eigen::Index r = 0; r < pulled.rows(); ++r) {
    const double length = pulled.row(r).norm();
    if (length > kVanished * scale) pulled.row(kept++) = (pulled.row(r) / length).eval();
  }
  return pulled.topRows(kept);
}

}  // namespace

Word EmptyWord(int n) { return {{}, Matrix::Identity(n, n), Matrix(0, n)}; }

Word Append(const PiecewiseLinearMap& map, const Word& word, int piece) {
  const LinearPiece& next = map.pieces()[piece];
  Word longer;
  longer.pieces = word.pieces;
  longer.pieces.push_back(piece);
  longer.matrix = next.matrix * word.matrix;
  const Matrix pulled = PullBack(next.cone, word.matrix);
  longer.cone.resize(word.cone.rows() + pulled.rows(), word.cone.cols());
  longer.cone << word.cone, pulled;
  return longer;
}

PiecewiseLinearMap ChangeCoordinates(const PiecewiseLinearMap& map, const Matrix& T) {
  const Matrix inverse = T.inverse();
  std::vector<LinearPiece> pieces = map.pieces();
  for (LinearPiece& piece : pieces) {
    piece.matrix = T * piece.matrix * inverse;
    piece.cone = PullBack(piece.cone, inverse);
  }
  return PiecewiseLinearMap(std::move(pieces));
}

double GainBound(const Word& word, double threshold, bool exact, ProgramBudget* budget) {
  const Eigen::Index n = word.matrix.rows();
  const Vector norms = word.matrix.cwiseAbs().rowwise().sum();
  const double norm = norms.maxCoeff();
  if (word.cone.rows() == 0 || !HaveLinearPrograms()) return norm;
  if (!exact && norm < threshold) return norm;
  const Vector bound = Vector::Ones(word.matrix.cols());
  LinearProgram program(word.cone, -bound, bound);
  double gain = 0;
  // The largest rows first: they decide soonest that the word does not contract.
  std::vector<Eigen::Index> order(n);
  for (Eigen::Index r = 0; r < n; ++r) order[r] = r;
  std::sort(order.begin(), order.end(),
            [&](Eigen::Index a, Eigen::Index b) { return norms(a) > norms(b); });
  for (Eigen::Index r : order) {
    if (norms(r) <= gain) break;
    for (double sign : {1.0, -1.0}) {
      if (!budget->Take(1)) return norm;
      const std::optional<LinearOptimum> optimum =
          program.Maximize(sign * word.matrix.row(r).transpose());
      if (!optimum) return norm;
      gain = std::max(gain, optimum->value);
      if (!exact && gain >= threshold) return norm;
    }
  }
  return gain;
}

}  // namespace contact_flow
