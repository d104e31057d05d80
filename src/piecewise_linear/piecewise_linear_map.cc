// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "cone_interior.h"
#include "contact_flow/budget.h"
#include "half_spaces.h"

namespace contact_flow {

double LinearPiece::Margin(const VectorRef& w) const {
  if (cone.rows() == 0) return std::numeric_limits<double>::infinity();
  return (cone * w).minCoeff();
}

PiecewiseLinearMap::PiecewiseLinearMap(std::vector<LinearPiece> pieces)
    : pieces_(std::move(pieces)) {
  if (pieces_.empty()) throw std::invalid_argument("a piecewise-linear map needs a piece");
}

PiecewiseLinearMap PiecewiseLinearMap::Linear(const Matrix& matrix) {
  LinearPiece piece;
  piece.matrix = matrix;
  piece.cone.resize(0, matrix.cols());
  return PiecewiseLinearMap({piece});
}

int PiecewiseLinearMap::PieceAt(const VectorRef& w) const {
  int best = 0;
  double margin = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < pieces_.size(); ++k) {
    const double m = pieces_[k].Margin(w);
    if (m > margin) {
      margin = m;
      best = static_cast<int>(k);
    }
  }
  return best;
}

Vector PiecewiseLinearMap::operator()(const VectorRef& w) const {
  return pieces_[PieceAt(w)].matrix * w;
}

PiecewiseLinearMap PiecewiseLinearMap::After(const PiecewiseLinearMap& inner,
                                             std::size_t max_pieces) const {
  if (cols() != inner.rows()) {
    throw std::invalid_argument("composition of a map on " + std::to_string(cols()) +
                                " with a map to " + std::to_string(inner.rows()) + " dimensions");
  }
  BudgetStage stage("the composition of pieces", inner.pieces_.size());
  std::vector<LinearPiece> words;
  double bytes = 0;
  for (const LinearPiece& first : inner.pieces_) {
    stage.Next();
    for (const LinearPiece& second : pieces_) {
      AskBudget();
      LinearPiece word;
      word.cone = Stack(first.cone, PullBack(second.cone, first.matrix));
      if (second.cone.rows() > 0 && first.cone.rows() > 0 && !HasInterior(word.cone)) continue;
      word.matrix = second.matrix * first.matrix;
      word.omega = first.omega;
      word.omega.insert(word.omega.end(), second.omega.begin(), second.omega.end());
      word.eta = first.eta;
      const bool joined = !word.eta.empty() && !second.eta.empty();
      word.eta.insert(word.eta.end(), second.eta.begin() + (joined ? 1 : 0), second.eta.end());
      word.words = first.words;
      const bool joins = !word.words.empty() && !second.words.empty();
      word.words.insert(word.words.end(), second.words.begin() + (joins ? 1 : 0),
                        second.words.end());
      bytes +=
          sizeof(LinearPiece) + 8.0 * static_cast<double>(word.matrix.size() + word.cone.size());
      words.push_back(std::move(word));
      if (words.size() % 64 == 0) {
        AskMemory(bytes, "the first " + std::to_string(words.size()) + " pieces");
      }
      if (words.size() > max_pieces) {
        throw std::length_error("the composed map has more than max_pieces = " +
                                std::to_string(max_pieces) + " pieces; directions are not limited");
      }
    }
  }
  return PiecewiseLinearMap(std::move(words));
}

double PiecewiseLinearMap::Kink() const {
  double kink = 0;
  for (const LinearPiece& piece : pieces_) {
    kink = std::max(kink, (piece.matrix - pieces_.front().matrix).cwiseAbs().maxCoeff());
  }
  return kink;
}

void RequireEntries(const PiecewiseLinearMap& map) {
  if (map.rows() > 0 && map.cols() > 0) return;
  throw std::invalid_argument("the map is " + std::to_string(map.rows()) + "×" +
                              std::to_string(map.cols()) + ": it has no entries");
}

}  // namespace contact_flow
