// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/mass_factor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "solve_columns.h"

namespace contact_flow {
namespace {

/// Fewer coordinates than these are not worth a look.
constexpr Eigen::Index kLeast = 12;
/// Multiplications of the dense factor, d³/6, for one of the sparse: it pays from here on.
constexpr double kGain = 3;
constexpr int kAbreast = 8;  // columns that are solved side by side

/// The last of column k's rows above the diagonal that are not zero, −1: none.
int LastRow(const std::uint64_t* column, int k) {
  int i = k - 1;
  while (i >= 0 && column[i] == 0) --i;
  return i;
}

/// 1 where a number is neither 0 nor −0, else 0; by its bits, so that loops of it are vectors.
inline std::uint64_t IsNonzero(double number) {
  std::uint64_t bits;
  std::memcpy(&bits, &number, sizeof(bits));
  bits <<= 1;  // without its sign
  return (bits | (0 - bits)) >> 63;
}

/// b ← b − c a, of the first n numbers.
inline void Subtract(double c, const double* __restrict a, int n, double* __restrict b) {
  for (int i = 0; i < n; ++i) b[i] -= c * a[i];
}

}  // namespace

void MassFactor::Compute(const Matrix& mass) {
  if (mass.rows() < kLeast) {
    sparse_ = false;
  } else if (!HasZerosAsBefore(mass)) {
    FindChains(mass);
  }
  if (sparse_) return ComputeSparse(mass);
  dense_.compute(mass);
  regular_ = dense_.info() == Eigen::Success;
}

bool MassFactor::HasZerosAsBefore(const Matrix& mass) const {
  const Eigen::Index d = mass.rows();
  if (nonzero_.size() != static_cast<std::size_t>(d * (d - 1) / 2)) return false;
  const std::uint64_t* before = nonzero_.data();
  std::uint64_t differs = 0;
  for (Eigen::Index k = 0; k < d; before += k, ++k) {
    const double* column = mass.data() + k * d;
    for (Eigen::Index i = 0; i < k; ++i) {
      differs |= IsNonzero(column[i]) ^ before[i];
    }
  }
  return differs == 0;
}

/// What column k has above its diagonal its carrier, the last of these rows, gets, too: elimination
/// from the last to the first fills that in.
void MassFactor::FindChains(const Matrix& mass) {
  const int d = static_cast<int>(mass.rows());
  nonzero_.resize(static_cast<std::size_t>(d) * (d - 1) / 2);
  const auto column = [&](int k) { return nonzero_.data() + k * (k - 1) / 2; };
  for (int k = 0; k < d; ++k) {
    for (int i = 0; i < k; ++i) column(k)[i] = IsNonzero(mass(i, k));
  }
  constexpr std::uint64_t kOfMass = 1, kFilled = 2;
  for (int k = d - 1; k >= 0; --k) {
    const int carrier = LastRow(column(k), k);
    for (int i = 0; i < carrier; ++i) {
      if (column(k)[i] != 0) column(carrier)[i] |= kFilled;
    }
  }
  rows_.clear();
  rows_.reserve(nonzero_.size() + d);
  begin_.assign(1, 0);
  begin_.reserve(d + 1);
  double work = 0;
  const double most = std::pow(d, 3) / 6 / kGain;
  for (int k = 0; k < d && work <= most; ++k) {
    const int carrier = LastRow(column(k), k);
    if (carrier >= 0) {
      for (int e = begin_[carrier]; e < begin_[carrier + 1]; ++e) rows_.push_back(rows_[e]);
    }
    const double count = static_cast<double>(rows_.size()) - begin_[k];
    work += 0.5 * count * (count + 3);
    rows_.push_back(k);
    begin_.push_back(static_cast<int>(rows_.size()));
  }
  for (std::uint64_t& entry : nonzero_) entry &= kOfMass;
  sparse_ = work <= most;
  columns_.resize(rows_.size());
}

void MassFactor::ComputeSparse(const Matrix& mass) {
  const int d = static_cast<int>(mass.rows());
  for (int k = 0; k < d; ++k) {
    const double* column = mass.data() + static_cast<std::ptrdiff_t>(k) * d;
    for (int e = begin_[k]; e < begin_[k + 1]; ++e) columns_[e] = column[rows_[e]];
  }
  regular_ = true;
  for (int k = d - 1; k >= 0; --k) {
    double* column = &columns_[begin_[k]];
    const int* rows = &rows_[begin_[k]];
    const int count = Diagonal(k) - begin_[k];
    if (!(column[count] > 0)) regular_ = false;
    const double root = column[count] = std::sqrt(column[count]);
    for (int e = 0; e < count; ++e) column[e] /= root;
    for (int e = 0; e < count; ++e) {
      Subtract(column[e], column, e + 1, &columns_[begin_[rows[e]]]);
    }
  }
}

Vector MassFactor::Pivots() const {
  if (!sparse_) return dense_.matrixLLT().diagonal();
  Vector pivots(static_cast<Eigen::Index>(begin_.size()) - 1);
  for (Eigen::Index k = 0; k < pivots.size(); ++k) pivots(k) = columns_[Diagonal(k)];
  return pivots;
}

template <int kColumns>
void MassFactor::SolveRowsL(double* rows) const {
  for (Eigen::Index k = static_cast<Eigen::Index>(begin_.size()) - 2; k >= 0; --k) {
    double own[kColumns];
    bool any = false;
    for (int c = 0; c < kColumns; ++c) any |= rows[k * kColumns + c] != 0;
    if (!any) continue;
    for (int c = 0; c < kColumns; ++c) {
      own[c] = rows[k * kColumns + c] /= columns_[Diagonal(k)];
    }
    for (int e = begin_[k]; e < Diagonal(k); ++e) {
      double* other = rows + static_cast<std::ptrdiff_t>(rows_[e]) * kColumns;
      for (int c = 0; c < kColumns; ++c) other[c] -= columns_[e] * own[c];
    }
  }
}

template <int kColumns>
void MassFactor::SolveRowsLTransposed(double* rows) const {
  for (Eigen::Index k = 0; k + 1 < static_cast<Eigen::Index>(begin_.size()); ++k) {
    double own[kColumns];
    for (int c = 0; c < kColumns; ++c) own[c] = rows[k * kColumns + c];
    for (int e = begin_[k]; e < Diagonal(k); ++e) {
      const double* other = rows + static_cast<std::ptrdiff_t>(rows_[e]) * kColumns;
      for (int c = 0; c < kColumns; ++c) own[c] -= columns_[e] * other[c];
    }
    for (int c = 0; c < kColumns; ++c) rows[k * kColumns + c] = own[c] / columns_[Diagonal(k)];
  }
}

void MassFactor::SolveL(Eigen::Ref<Vector> b) const {
  if (!sparse_) {
    dense_.matrixL().solveInPlace(b);
    return;
  }
  SolveRowsL<1>(b.data());
}

void MassFactor::SolveLTransposed(Eigen::Ref<Vector> b) const {
  if (!sparse_) {
    dense_.matrixU().solveInPlace(b);
    return;
  }
  SolveRowsLTransposed<1>(b.data());
}

void MassFactor::SolveColumns(bool by_both, Matrix* B) const {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, kAbreast, Eigen::RowMajor>;
  thread_local Rows rows;  // makes room once
  const Eigen::Index whole = B->cols() - B->cols() % kAbreast;
  rows.resize(B->rows(), kAbreast);
  for (Eigen::Index c = 0; c < whole; c += kAbreast) {
    rows = B->middleCols<kAbreast>(c);
    if (by_both) SolveRowsL<kAbreast>(rows.data());
    SolveRowsLTransposed<kAbreast>(rows.data());
    B->middleCols<kAbreast>(c) = rows;
  }
  for (Eigen::Index c = whole; c < B->cols(); ++c) {
    if (by_both) SolveL(B->col(c));
    SolveLTransposed(B->col(c));
  }
}

void MassFactor::SolveLTransposed(Matrix* B) const {
  if (!sparse_) {
    dense_.matrixU().solveInPlace(*B);
    return;
  }
  SolveColumns(false, B);
}

void MassFactor::Solve(Matrix* B) const {
  if (!sparse_) return contact_flow::SolveColumns(dense_, B);
  SolveColumns(true, B);
}

Matrix MassFactor::Solved(const MatrixRef& B) const {
  if (!sparse_) return dense_.solve(B);
  Matrix result = B;
  Solve(&result);
  return result;
}

}  // namespace contact_flow
