// SPDX-License-Identifier: BSD-3-Clause
#include "loop_growth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/piecewise_linear/stabilizing_feedback.h"

namespace contact_flow {
namespace {

constexpr double kLeastGrowth = 1e-2;  // less is not told apart
constexpr double kNearer = 1e-3;       // relative, than which bounds need not be
constexpr double kLeastNext = 0.8;     // what is tried next, of what was proven
constexpr int kMaxTries = 6;
constexpr long kFewWords = 300, kFewPrograms = 3000;  // for each

/// `word` of a loop of one gain, by the pieces of `step`: the loop may have lost some.
std::vector<int> WordOfStep(const PiecewiseLinearMap& step, const Matrix& gain,
                            const PiecewiseLinearMap& closed, const std::vector<int>& word) {
  Matrix graph(step.cols(), step.rows());
  graph << Matrix::Identity(step.rows(), step.rows()), gain;
  std::vector<int> found;
  for (int i : word) {
    const auto away = [&](const LinearPiece& piece) {
      return (piece.matrix * graph - closed.pieces()[i].matrix).norm();
    };
    const auto nearest = std::min_element(
        step.pieces().begin(), step.pieces().end(),
        [&](const LinearPiece& a, const LinearPiece& b) { return away(a) < away(b); });
    found.push_back(static_cast<int>(nearest - step.pieces().begin()));
  }
  return found;
}

}  // namespace

LoopGrowth GrowthOf(const PiecewiseLinearMap& step, const Matrix& gain, double below,
                    const StabilityOptions& stability) {
  StabilityOptions options = stability;
  options.max_words = std::min(options.max_words, kFewWords);
  options.max_linear_programs = std::min(options.max_linear_programs, kFewPrograms);
  options.consistency.checked = true;  // the step is one map
  const PiecewiseLinearMap closed = ClosedLoop(step, PiecewiseLinearMap::Linear(gain));
  LoopGrowth growth;
  growth.above = std::numeric_limits<double>::infinity();
  const double unproven = std::max(below, kLeastGrowth);
  double low = kLeastGrowth, tried = (1 + kNearer) * unproven;
  for (int k = 0; k < kMaxTries; ++k) {
    std::vector<LinearPiece> pieces = closed.pieces();
    for (LinearPiece& piece : pieces) piece.matrix /= tried;
    const StabilityReport report = AssessStability(PiecewiseLinearMap(pieces), options);
    const bool is_stable = report.verdict == StabilityVerdict::kStable;
    growth.above = std::min({growth.above, tried * report.growth_above,
                             is_stable ? tried : std::numeric_limits<double>::infinity()});
    low = std::max({low, tried * report.growth_below, is_stable ? 0 : tried});
    const bool grows = report.verdict == StabilityVerdict::kUnstable && tried > unproven;
    if (grows && !report.certificate.words.empty()) {
      growth.word = WordOfStep(step, gain, closed, report.certificate.words.front());
    }
    if (!(growth.above > (1 + kNearer) * low)) break;
    tried = std::max(std::sqrt(low * growth.above), kLeastNext * growth.above);
  }
  return growth;
}

}  // namespace contact_flow
