// SPDX-License-Identifier: BSD-3-Clause
#include "gain_of_words.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <random>

#include "contact_flow/budget.h"
#include "contact_flow/piecewise_linear/descent.h"

namespace contact_flow {
namespace {

/// Descents from around the best end: sweeps from its own size down, until as many in a row were
/// not worth it.
constexpr int kHopsOfSweep = 10, kMaxSweeps = 6, kIdleSweeps = 2;
constexpr double kNextHop = 0.5;     // size of a hop, of the one before
constexpr double kWorthHops = 1e-3;  // relative gain of a sweep that is worth others
/// No further descent after so many products of numbers in loops and words, by their order.
constexpr double kMaxDescentWork = 1e9;

/// The growth along words as a cost of the gain.
class WordGrowth {
 public:
  WordGrowth(const PiecewiseLinearMap& step, const std::vector<std::vector<int>>& words)
      : step_(step), words_(words), n_(step.rows()), m_(step.cols() - step.rows()) {
    for (const std::vector<int>& word : words) letters_ += static_cast<double>(word.size());
  }

  CostValue At(const Vector& y) const {
    const std::vector<Matrix> loops = LoopsOf(y);
    CostValue value;
    const std::vector<int>* worst = Worst(loops, &value.cost);
    value.defined = std::isfinite(value.cost);
    if (!value.defined || worst == nullptr) return value;
    const Matrix gradient = Gradient(loops, *worst);
    value.map = PiecewiseLinearMap::Linear(gradient.reshaped().transpose());
    value.has_map = gradient.allFinite();
    return value;
  }
  double Value(const Vector& y) const {
    double growth = 0;
    Worst(LoopsOf(y), &growth);
    return growth;
  }
  Matrix GainOf(const Vector& y) const { return Eigen::Map<const Matrix>(y.data(), m_, n_); }
  /// What was computed so far, in products of numbers.
  double work() const { return work_; }

 private:
  std::vector<Matrix> LoopsOf(const Vector& y) const {
    const Matrix K = GainOf(y);
    std::vector<Matrix> loops;
    for (const LinearPiece& piece : step_.pieces()) {
      AskBudget();
      loops.push_back(piece.matrix.leftCols(n_) + piece.matrix.rightCols(m_) * K);
    }
    return loops;
  }

  /// The word of the largest growth; null where none grows, +∞ where that is not to be had.
  const std::vector<int>* Worst(const std::vector<Matrix>& loops, double* growth) const {
    constexpr double kEigenvalues = 10;  // of a matrix, in products of two
    const double cube = std::pow(static_cast<double>(n_), 3);
    work_ += cube * (letters_ + kEigenvalues * static_cast<double>(words_.size()));
    const std::vector<int>* worst = nullptr;
    *growth = 0;
    for (const std::vector<int>& word : words_) {
      AskBudget();
      Matrix product = loops[word.front()];
      for (std::size_t j = 1; j < word.size(); ++j) product = (loops[word[j]] * product).eval();
      const Eigen::EigenSolver<Matrix> spectrum(product, false);
      const bool is_known = product.allFinite() && spectrum.info() == Eigen::Success;
      const double size = is_known ? spectrum.eigenvalues().cwiseAbs().maxCoeff()
                                   : std::numeric_limits<double>::infinity();
      const double mean = std::pow(size, 1 / static_cast<double>(word.size()));
      if (!(mean > *growth)) continue;
      *growth = mean;
      worst = &word;
    }
    return worst;
  }

  /// By d|λ| = Re(λ̄ u dA_w v) / |λ|, u the row of the inverse of the eigenvectors.
  Matrix Gradient(const std::vector<Matrix>& loops, const std::vector<int>& word) const {
    std::vector<Matrix> before = {Matrix::Identity(n_, n_)};
    for (int i : word) before.push_back(loops[i] * before.back());
    const Eigen::EigenSolver<Matrix> spectrum(before.back());
    Eigen::Index k = 0;
    const double size = spectrum.eigenvalues().cwiseAbs().maxCoeff(&k);
    const std::complex<double> turn = std::conj(spectrum.eigenvalues()(k)) / size;
    const Eigen::MatrixXcd vectors = spectrum.eigenvectors();
    Eigen::RowVectorXcd u = vectors.inverse().row(k);
    Matrix gradient = Matrix::Zero(m_, n_);
    for (std::size_t j = word.size(); j-- > 0;) {
      const Matrix B = step_.pieces()[word[j]].matrix.rightCols(m_);
      const Eigen::VectorXcd v = before[j] * vectors.col(k);
      gradient += (turn * (u * B).transpose() * v.transpose()).real();
      u = (u * loops[word[j]]).eval();
    }
    const double length = static_cast<double>(word.size());
    return std::pow(size, 1 / length - 1) / length * gradient;
  }

  const PiecewiseLinearMap& step_;
  const std::vector<std::vector<int>>& words_;
  const Eigen::Index n_, m_;
  double letters_ = 0;
  mutable double work_ = 0;
};

/// In [−1, 1].
Vector RandomHop(Eigen::Index n, std::mt19937* random) {
  Vector hop(n);
  for (double& entry : hop) entry = 2.0 * (*random)() / std::mt19937::max() - 1;
  return hop;
}

}  // namespace

double GrowthAlong(const PiecewiseLinearMap& step, const std::vector<std::vector<int>>& words,
                   const Matrix& gain) {
  return WordGrowth(step, words).Value(gain.reshaped());
}

GainOfWords FindGainOfWords(const PiecewiseLinearMap& step,
                            const std::vector<std::vector<int>>& words,
                            const std::vector<Matrix>& starts,
                            const std::function<bool()>& cancelled) {
  const BudgetStage stage("the descents of a gain");
  const WordGrowth growth(step, words);
  const auto is_cancelled = [&] { return cancelled && cancelled(); };
  DescentOptions options;
  options.progress = [&](const DescentIteration&, const Vector&) { return !is_cancelled(); };
  const NonsmoothCost cost = [&](const Vector& y, CostQuery) { return growth.At(y); };
  Vector best = starts.front().reshaped();
  double least = growth.Value(best), spread = 0;
  const auto descend = [&](const Vector& from) {
    const Vector end = Minimize(cost, from, options).y;
    const double reached = growth.Value(end);
    if (!(reached < least)) return;
    best = end;
    least = reached;
  };
  for (const Matrix& start : starts) {
    AskBudget();
    spread = std::max(spread, start.norm());
    if (growth.work() <= kMaxDescentWork) descend(start.reshaped());
  }
  std::mt19937 random(1);
  for (int sweep = 0, idle = 0; sweep < kMaxSweeps && idle < kIdleSweeps; ++sweep) {
    const double before = least;
    double size = std::max(spread, best.norm()) / std::sqrt(static_cast<double>(best.size()));
    for (int hop = 0; hop < kHopsOfSweep; ++hop, size *= kNextHop) {
      AskBudget();
      if (is_cancelled() || growth.work() > kMaxDescentWork) return {growth.GainOf(best), least};
      descend(best + size * RandomHop(best.size(), &random));
    }
    idle = least < (1 - kWorthHops) * before ? 0 : idle + 1;
  }
  return {growth.GainOf(best), least};
}

}  // namespace contact_flow
