// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/mass_factor.h"

#include <algorithm>
#include <cmath>

#include "solve_columns.h"

namespace contact_flow {
namespace {

/// Fewer coordinates than these are not worth a look.
constexpr Eigen::Index kLeast = 12;
/// Multiplications of the dense factor, d³/6, for one of the sparse: it pays from here on.
constexpr double kGain = 3;
constexpr int kWord = 64;

}  // namespace

void MassFactor::Compute(const Matrix& mass) {
  sparse_ = mass.rows() >= kLeast && FindPattern(mass);
  if (sparse_) return ComputeSparse(mass);
  dense_.compute(mass);
  regular_ = dense_.info() == Eigen::Success;
}

/// What column k has above its diagonal its parent, the last of these rows, gets, too: elimination
/// from the last to the first fills that in. While M has the zeros that it had, all is as found.
bool MassFactor::FindPattern(const Matrix& mass) {
  const int d = static_cast<int>(mass.rows());
  const int words = (d + kWord - 1) / kWord;
  const std::ptrdiff_t size = static_cast<std::ptrdiff_t>(d) * words;
  // The factor's, those of the M that it was found for, and those of this M.
  const bool found = static_cast<std::ptrdiff_t>(bits_.size()) == 3 * size;
  if (!found) bits_.resize(static_cast<std::size_t>(3 * size));
  std::uint64_t *filled = bits_.data(), *before = filled + size, *now = before + size;
  std::fill(now, now + size, 0);
  for (int k = 0; k < d; ++k) {
    const double* column = mass.data() + static_cast<std::ptrdiff_t>(k) * d;
    std::uint64_t* own = now + static_cast<std::ptrdiff_t>(k) * words;
    for (int i = 0; i < k; ++i) {
      own[i / kWord] |= static_cast<std::uint64_t>(column[i] != 0) << (i % kWord);
    }
  }
  if (found && std::equal(now, now + size, before)) return !begin_.empty();
  std::copy(now, now + size, before);
  std::copy(now, now + size, filled);
  begin_.clear();
  rows_.clear();
  double work = 0;
  const double most = std::pow(d, 3) / 6 / kGain;
  for (int k = d - 1; k >= 0; --k) {
    const std::uint64_t* own = filled + static_cast<std::ptrdiff_t>(k) * words;
    int count = 0, parent = -1;
    for (int w = 0; w < words; ++w) {
      if (own[w] == 0) continue;
      count += __builtin_popcountll(own[w]);
      parent = w * kWord + kWord - 1 - __builtin_clzll(own[w]);
    }
    work += 0.5 * count * (count + 3);
    if (work > most) return false;
    if (parent < 0) continue;
    std::uint64_t* other = filled + static_cast<std::ptrdiff_t>(parent) * words;
    for (int w = 0; w < words; ++w) other[w] |= own[w];
    other[parent / kWord] &= ~(std::uint64_t{1} << (parent % kWord));
  }
  begin_.assign(d + 1, 0);
  for (int k = 0; k < d; ++k) {
    begin_[k] = static_cast<int>(rows_.size());
    for (int w = 0; w < words; ++w) {
      for (std::uint64_t rest = filled[static_cast<std::ptrdiff_t>(k) * words + w]; rest != 0;
           rest &= rest - 1) {
        rows_.push_back(w * kWord + __builtin_ctzll(rest));
      }
    }
  }
  begin_[d] = static_cast<int>(rows_.size());
  return true;
}

void MassFactor::ComputeSparse(const Matrix& mass) {
  const int d = static_cast<int>(mass.rows());
  upper_.resize(d, d);  // what is not in the pattern is never looked at
  for (int k = 0; k < d; ++k) {
    upper_(k, k) = mass(k, k);
    for (int e = begin_[k]; e < begin_[k + 1]; ++e) upper_(rows_[e], k) = mass(rows_[e], k);
  }
  regular_ = true;
  for (int k = d - 1; k >= 0; --k) {
    const double pivot = upper_(k, k);
    if (!(pivot > 0)) regular_ = false;
    const double root = std::sqrt(pivot);
    upper_(k, k) = root;
    double* column = &upper_(0, k);
    for (int e = begin_[k]; e < begin_[k + 1]; ++e) {
      const int i = rows_[e];
      column[i] /= root;
      double* other = &upper_(0, i);
      for (int f = begin_[k]; f <= e; ++f) other[rows_[f]] -= column[i] * column[rows_[f]];
    }
  }
}

void MassFactor::SolveL(Eigen::Ref<Vector> b) const {
  if (!sparse_) {
    dense_.matrixL().solveInPlace(b);
    return;
  }
  for (Eigen::Index k = b.size() - 1; k >= 0; --k) {
    if (b(k) == 0) continue;
    const double* column = upper_.data() + k * upper_.rows();
    const double value = b(k) /= column[k];
    for (int e = begin_[k]; e < begin_[k + 1]; ++e) b(rows_[e]) -= column[rows_[e]] * value;
  }
}

void MassFactor::SolveLTransposed(Eigen::Ref<Vector> b) const {
  if (!sparse_) {
    dense_.matrixU().solveInPlace(b);
    return;
  }
  for (Eigen::Index k = 0; k < b.size(); ++k) {
    const double* column = upper_.data() + k * upper_.rows();
    double value = b(k);
    for (int e = begin_[k]; e < begin_[k + 1]; ++e) value -= column[rows_[e]] * b(rows_[e]);
    b(k) = value / column[k];
  }
}

void MassFactor::SolveLTransposed(Matrix* B) const {
  if (!sparse_) {
    dense_.matrixU().solveInPlace(*B);
    return;
  }
  for (Eigen::Index c = 0; c < B->cols(); ++c) SolveLTransposed(B->col(c));
}

void MassFactor::Solve(Matrix* B) const {
  if (!sparse_) return SolveColumns(dense_, B);
  for (Eigen::Index c = 0; c < B->cols(); ++c) {
    SolveL(B->col(c));
    SolveLTransposed(B->col(c));
  }
}

Matrix MassFactor::Solved(const MatrixRef& B) const {
  if (!sparse_) return dense_.solve(B);
  Matrix result = B;
  Solve(&result);
  return result;
}

}  // namespace contact_flow
