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
constexpr int kWord = 64;
constexpr int kAbreast = 8;  // columns that are solved side by side

/// The coordinate that carries each of M's, −1: none. What column k has above its diagonal its
/// carrier, the last of these rows, gets, too: elimination from the last to the first fills that in.
std::vector<int> Carriers(const Matrix& mass) {
  const int d = static_cast<int>(mass.rows());
  const int words = (d + kWord - 1) / kWord;
  std::vector<std::uint64_t> bits(static_cast<std::size_t>(d) * words);
  std::vector<int> carriers(d, -1);
  for (int k = d - 1; k >= 0; --k) {
    std::uint64_t* own = &bits[static_cast<std::size_t>(k) * words];
    for (int i = 0; i < k; ++i) {
      if (mass(i, k) != 0) own[i / kWord] |= std::uint64_t{1} << (i % kWord);
    }
    for (int w = 0; w < words; ++w) {
      if (own[w] != 0) carriers[k] = w * kWord + kWord - 1 - __builtin_clzll(own[w]);
    }
    if (carriers[k] < 0) continue;
    std::uint64_t* other = &bits[static_cast<std::size_t>(carriers[k]) * words];
    for (int w = 0; w < words; ++w) other[w] |= own[w];
    other[carriers[k] / kWord] &= ~(std::uint64_t{1} << (carriers[k] % kWord));
  }
  return carriers;
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

void MassFactor::FindChains(const Matrix& mass) {
  const int d = static_cast<int>(mass.rows());
  nonzero_.clear();
  for (int k = 0; k < d; ++k) {
    for (int i = 0; i < k; ++i) nonzero_.push_back(IsNonzero(mass(i, k)));
  }
  begin_.assign(1, 0);
  rows_.clear();
  sparse_ = false;
  double work = 0;
  const double most = std::pow(d, 3) / 6 / kGain;
  const std::vector<int> carriers = Carriers(mass);
  for (int k = 0; k < d; ++k) {
    if (carriers[k] >= 0) {
      for (int e = begin_[carriers[k]]; e < begin_[carriers[k] + 1]; ++e) rows_.push_back(rows_[e]);
    }
    const double count = static_cast<double>(rows_.size()) - begin_[k];
    work += 0.5 * count * (count + 3);
    if (work > most) return;
    rows_.push_back(k);
    begin_.push_back(static_cast<int>(rows_.size()));
  }
  columns_.resize(rows_.size());
  sparse_ = true;
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
