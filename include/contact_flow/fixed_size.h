// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <type_traits>

#include "contact_flow/types.h"

namespace contact_flow {

/// Calls f(n) with n as a compile-time constant when it is small, so that loops to n unroll: the
/// numbers of coordinates and contacts are known only at run time, and most are small.
template <class Function>
void WithFixedSize(int n, Function&& f) {
  switch (n) {
    case 1:
      return f(std::integral_constant<int, 1>());
    case 2:
      return f(std::integral_constant<int, 2>());
    case 3:
      return f(std::integral_constant<int, 3>());
    case 4:
      return f(std::integral_constant<int, 4>());
    case 5:
      return f(std::integral_constant<int, 5>());
    case 6:
      return f(std::integral_constant<int, 6>());
    case 7:
      return f(std::integral_constant<int, 7>());
    case 8:
      return f(std::integral_constant<int, 8>());
    default:
      return f(n);
  }
}

/// n numbers that are summed up: in registers where n is a compile-time constant of WithFixedSize,
/// and in memory, at `out`, where it is not. Sums in memory are not vectorized and
/// take twice the time.
template <class Size>
class ColumnSum {
 public:
  ColumnSum(Size, double*) {}
  void Add(double factor, const double* column) { sum_ += factor * Eigen::Map<const Sum>(column); }
  void WriteTo(double* out) const { Eigen::Map<Sum>{out} = sum_; }

 private:
  using Sum = Eigen::Matrix<double, Size::value, 1>;
  Sum sum_ = Sum::Zero();
};

template <>
class ColumnSum<int> {
 public:
  ColumnSum(int n, double* out) : n_(n), sum_(out) {
    for (int r = 0; r < n_; ++r) sum_[r] = 0;
  }
  void Add(double factor, const double* __restrict column) {
    double* __restrict sum = sum_;
    for (int r = 0; r < n_; ++r) sum[r] += factor * column[r];
  }
  void WriteTo(double*) const {}

 private:
  const int n_;
  double* const sum_;
};

/// out = sign · A B, where the number of A's rows is a compile-time constant: two columns of B at a
/// time share the loads of A. Columns of `out` are `stride` apart.
template <class Rows>
void MultiplyFixedRows(Rows rows, double sign, const MatrixRef& A, const MatrixRef& B, double* out,
                       Eigen::Index stride) {
  Eigen::Index c = 0;
  for (; c + 1 < B.cols(); c += 2, out += 2 * stride) {
    ColumnSum first(rows, out), second(rows, out + stride);
    const double *b = B.col(c).data(), *beside = B.col(c + 1).data();
    for (Eigen::Index k = 0; k < A.cols(); ++k) {
      if (b[k] == 0 && beside[k] == 0) continue;
      first.Add(sign * b[k], A.col(k).data());
      second.Add(sign * beside[k], A.col(k).data());
    }
    first.WriteTo(out);
    second.WriteTo(out + stride);
  }
  for (; c < B.cols(); ++c, out += stride) {
    ColumnSum sum(rows, out);
    for (Eigen::Index k = 0; k < A.cols(); ++k) sum.Add(sign * B(k, c), A.col(k).data());
    sum.WriteTo(out);
  }
}

/// out = sign · A B. Eigen's general product packs both factors, which takes longer than the
/// product where A has few rows.
inline void MultiplyFewRows(double sign, const Matrix& A, const Matrix& B, Matrix* out) {
  out->resize(A.rows(), B.cols());
  WithFixedSize(static_cast<int>(A.rows()), [&](auto rows) {
    if constexpr (std::is_same_v<decltype(rows), int>) {
      out->noalias() = sign * A * B;
    } else {
      MultiplyFixedRows(rows, sign, A, B, out->data(), out->rows());
    }
  });
}

}  // namespace contact_flow
