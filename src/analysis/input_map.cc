// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/input_map.h"

#include <stdexcept>
#include <utility>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

/// (x, U) ↦ (B(x, u_k), U) for U = (u_1, …, u_K).
PiecewiseLinearMap Step(const PiecewiseLinearMap& B, int k, int inputs, int count) {
  const int n = B.rows(), all = inputs * count;
  Matrix select = Matrix::Zero(n + inputs, n + all);
  select.topLeftCorner(n, n).setIdentity();
  select.block(n, n + k * inputs, inputs, inputs).setIdentity();
  std::vector<LinearPiece> pieces = B.pieces();
  for (LinearPiece& piece : pieces) {
    Matrix larger = Matrix::Zero(n + all, n + all);
    larger.topRows(n) = piece.matrix * select;
    larger.bottomRightCorner(all, all).setIdentity();
    piece.matrix = larger;
    piece.cone = (piece.cone * select).eval();
  }
  return PiecewiseLinearMap(std::move(pieces));
}

}  // namespace

PiecewiseLinearMap InputMap(const std::vector<IntervalLinearization>& intervals,
                            std::size_t max_pieces) {
  if (intervals.empty()) throw std::invalid_argument("a run has at least one interval");
  for (const IntervalLinearization& interval : intervals) {
    if (!interval.status.ok()) throw std::invalid_argument(interval.status.message);
  }
  const int count = static_cast<int>(intervals.size());
  const int n = static_cast<int>(intervals.front().derivative.time.size());
  const int inputs = static_cast<int>(intervals.front().derivative.arcs.front().cols()) - n;
  if (inputs == 0) throw std::invalid_argument("the model has no inputs");
  Matrix start = Matrix::Zero(n + inputs * count, inputs * count);
  start.bottomRows(inputs * count).setIdentity();
  BudgetStage stage("the map of the inputs, interval by interval", intervals.size());
  PiecewiseLinearMap map = PiecewiseLinearMap::Linear(start);
  for (int k = 0; k < count; ++k) {
    map = Step(intervals[k].derivative.Pieces(), k, inputs, count).After(map, max_pieces);
    stage.Next();
  }
  return PiecewiseLinearMap::Linear(Matrix::Identity(n, map.rows())).After(map, max_pieces);
}

}  // namespace contact_flow
