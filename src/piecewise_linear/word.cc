// SPDX-License-Identifier: BSD-3-Clause
#include "word.h"

#include <Eigen/LU>
#include <algorithm>

#include "contact_flow/piecewise_linear/linear_program.h"
#include "half_spaces.h"

namespace contact_flow {

Word EmptyWord(int n) { return {{}, Matrix::Identity(n, n), Matrix(0, n)}; }

Word Append(const PiecewiseLinearMap& map, const Word& word, int piece) {
  const LinearPiece& next = map.pieces()[piece];
  Word longer;
  longer.pieces = word.pieces;
  longer.pieces.push_back(piece);
  longer.matrix = next.matrix * word.matrix;
  longer.cone = Stack(word.cone, PullBack(next.cone, word.matrix));
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
