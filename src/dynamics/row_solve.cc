// SPDX-License-Identifier: BSD-3-Clause
#include "row_solve.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace contact_flow {

template <class Entry, class First, class End>
void RowSolver::NonzeroRows::Fill(int rows, int columns, const Entry& entry, const First& first,
                                  const End& end) {
  begin_.resize(rows + 1);
  entries_.resize(rows * columns);
  int count = 0;
  for (int i = 0; i < rows; ++i) {
    begin_[i] = count;
    for (int j = first(i), last = end(i); j < last; ++j) {
      const double value = entry(i, j);
      if (value != 0) entries_[count++] = {j, value};
    }
  }
  begin_[rows] = count;
}

inline RowSolver::Row RowSolver::NonzeroRows::Multiply(int i, const Rows& B) const {
  Row sum = Row::Zero();
  for (int e = begin_[i]; e < begin_[i + 1]; ++e) {
    sum += entries_[e].value * B.col(entries_[e].column);
  }
  return sum;
}

/// Rows `row` of −`columns`, `count` of them from `first` on, one behind another; zeros beyond.
void RowSolver::Gather(const std::vector<const double*>& columns, const std::vector<int>& row,
                       int first, int count, Rows* rows) {
  if (count < kWidth) rows->setZero();
  const auto size = static_cast<int>(row.size());
  for (int c = 0; c < count; ++c) {
    const double* column = columns[first + c];
    double* out = rows->data() + c;
    for (int i = 0; i < size; ++i, out += kWidth) *out = -column[row[i]];
  }
}

void RowSolver::Scatter(const Rows& rows, int first, int count, Matrix* to) {
  const Eigen::Index size = rows.cols();
  for (int c = 0; c < count; ++c) {
    const double* from = rows.data() + c;
    double* column = to->col(first + c).data();
    for (Eigen::Index i = 0; i < size; ++i, from += kWidth) column[i] = *from;
  }
}

void RowSolver::Start(const std::vector<int>& rows) {
  momentum_.clear();
  constraint_.clear();
  rows_ = rows;
}

void RowSolver::Add(const Matrix& momentum, const Matrix& constraint) {
  for (Eigen::Index c = 0; c < momentum.cols(); ++c) {
    momentum_.push_back(momentum.col(c).data());
    constraint_.push_back(constraint.col(c).data());
  }
}

void RowSolver::Factorize(const Matrix& M, const Matrix& A) {
  const auto d = static_cast<int>(M.rows()), k = static_cast<int>(A.rows());
  L_ = M;
  W_ = A.transpose();
  pivots_.resize(d);
  for (int c = d - 1; c >= 0; --c) {
    double* column = L_.col(c).data();
    support_.clear();
    for (int i = 0; i < c; ++i) {
      if (column[i] != 0) support_.push_back(i);
    }
    const double pivot = 1 / std::sqrt(column[c]);
    pivots_(c) = pivot;
    for (int i : support_) column[i] *= pivot;
    for (int i : support_) {
      for (int j : support_) {
        if (j > i) break;
        L_(j, i) -= column[i] * column[j];
      }
    }
    for (int i = 0; i < k; ++i) {
      double* b = W_.col(i).data();
      if (b[c] == 0) continue;
      b[c] *= pivot;
      for (int j : support_) b[j] -= column[j] * b[c];
    }
  }
  const auto none = [](int) { return 0; };
  const auto of_L = [&](int i, int j) { return L_(i, j); };
  const auto of_Lt = [&](int i, int j) { return L_(j, i); };
  above_.Fill(
      d, d, of_L, [](int i) { return i + 1; }, [d](int) { return d; });
  below_.Fill(d, d, of_Lt, none, [](int i) { return i; });
  reach_.Fill(
      d, k, [&](int i, int j) { return W_(i, j); }, none, [k](int) { return k; });
  reached_.Fill(
      k, d, [&](int i, int j) { return W_(j, i); }, none, [d](int) { return d; });
}

/// WᵀW Λ = B, in place.
void RowSolver::SolveDelassus(const Matrix& factor) {
  const auto k = static_cast<int>(factor.rows());
  for (int i = 0; i < k; ++i) {
    Row sum = force_.col(i);
    for (int j = 0; j < i; ++j) sum -= factor(i, j) * force_.col(j);
    force_.col(i) = sum * delassus_pivots_(i);
  }
  for (int i = k - 1; i >= 0; --i) {
    Row sum = force_.col(i);
    for (int j = i + 1; j < k; ++j) sum -= factor(j, i) * force_.col(j);
    force_.col(i) = sum * delassus_pivots_(i);
  }
}

void RowSolver::Solve(const Matrix& M, const Matrix& A, const Eigen::LLT<Matrix>& delassus,
                      Matrix* X, Matrix* Lambda) {
  Factorize(M, A);
  const auto d = static_cast<int>(W_.rows()), k = static_cast<int>(W_.cols());
  const auto columns = static_cast<int>(momentum_.size());
  delassus_pivots_ = delassus.matrixLLT().diagonal().cwiseInverse();
  all_.resize(d);
  std::iota(all_.begin(), all_.end(), 0);
  x_.resize(kWidth, d);
  y_.resize(kWidth, d);
  force_.resize(kWidth, k);
  for (int first = 0; first < columns; first += kWidth) {
    const int count = std::min(kWidth, columns - first);
    Gather(momentum_, all_, first, count, &y_);
    Gather(constraint_, rows_, first, count, &force_);
    for (int i = d - 1; i >= 0; --i) {  // −Y
      y_.col(i) = (y_.col(i) - above_.Multiply(i, y_)) * pivots_(i);
    }
    for (int i = 0; i < k; ++i) force_.col(i) -= reached_.Multiply(i, y_);
    SolveDelassus(delassus.matrixLLT());
    for (int i = 0; i < d; ++i) {
      const Row right = y_.col(i) + reach_.Multiply(i, force_);
      x_.col(i) = (right - below_.Multiply(i, x_)) * pivots_(i);
    }
    Scatter(x_, first, count, X);
    Scatter(force_, first, count, Lambda);
  }
}

}  // namespace contact_flow
