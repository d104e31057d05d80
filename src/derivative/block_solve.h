// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <utility>

#include "contact_flow/types.h"

namespace contact_flow {

/// Solves A X = B in place (X into B) for A made of s×s blocks of m×m, by block Gaussian
/// elimination with pivots inside the diagonal blocks only. Made for the collocation matrices I −
/// h(…), whose diagonal blocks are near the identity at every step length that meets the tolerance.
/// `m` may be a compile-time constant (WithFixedSize): then the loops unroll, which at these sizes
/// halves the time of a general LU. Returns false when a pivot vanishes.
template <class Rows>
class BlockSolve {
 public:
  static bool Run(Rows m, int s, Matrix* A, Matrix* B) {
    const int n = static_cast<int>(A->rows()), columns = static_cast<int>(B->cols());
    double* a = A->data();
    double* b = B->data();
    const auto block = [&](int i, int j) { return a + i * m + j * m * n; };
    for (int k = 0; k < s; ++k) {
      if (!Invert(m, block(k, k), n)) return false;
      for (int i = k + 1; i < s; ++i) {
        MultiplyRight(m, block(i, k), block(k, k), n);
        Subtract(m, block(i, k + 1), block(i, k), block(k, k + 1), n, n, n, (s - k - 1) * m);
        Subtract(m, b + i * m, block(i, k), b + k * m, n, n, n, columns);
      }
    }
    for (int k = s - 1; k >= 0; --k) {
      for (int j = k + 1; j < s; ++j) {
        Subtract(m, b + k * m, block(k, j), b + j * m, n, n, n, columns);
      }
      for (int c = 0; c < columns; ++c) MultiplyLeft(m, block(k, k), n, b + k * m + c * n);
    }
    return true;
  }

 private:
  static constexpr int kMaxFixed = 8;

  /// C [m×columns] −= L [m×m] R [m×columns].
  static void Subtract(Rows m, double* C, const double* L, const double* R, int ldc, int ldl,
                       int ldr, int columns) {
    // Two columns at a time share the loads of L; the sums stay in registers.
    double first[kMaxFixed], second[kMaxFixed];
    int c = 0;
    for (; c + 1 < columns; c += 2) {
      double *one = C + c * ldc, *two = one + ldc;
      const double *right = R + c * ldr, *beside = right + ldr;
      for (int r = 0; r < m; ++r) first[r] = one[r];
      for (int r = 0; r < m; ++r) second[r] = two[r];
      for (int k = 0; k < m; ++k) {
        const double* left = L + k * ldl;
        const double f = right[k], g = beside[k];
        for (int r = 0; r < m; ++r) {
          first[r] -= left[r] * f;
          second[r] -= left[r] * g;
        }
      }
      for (int r = 0; r < m; ++r) one[r] = first[r];
      for (int r = 0; r < m; ++r) two[r] = second[r];
    }
    for (; c < columns; ++c) {
      double* one = C + c * ldc;
      for (int k = 0; k < m; ++k) {
        for (int r = 0; r < m; ++r) one[r] -= L[k * ldl + r] * R[c * ldr + k];
      }
    }
  }

  /// x ← D x.
  static void MultiplyLeft(Rows m, const double* D, int ld, double* x) {
    double sum[kMaxFixed];
    for (int r = 0; r < m; ++r) sum[r] = 0;
    for (int k = 0; k < m; ++k) {
      for (int r = 0; r < m; ++r) sum[r] += D[k * ld + r] * x[k];
    }
    for (int r = 0; r < m; ++r) x[r] = sum[r];
  }

  /// L ← L D.
  static void MultiplyRight(Rows m, double* L, const double* D, int ld) {
    double product[kMaxFixed * kMaxFixed];
    for (int c = 0; c < m; ++c) {
      double* __restrict column = product + c * m;
      for (int r = 0; r < m; ++r) column[r] = 0;
      for (int k = 0; k < m; ++k) {
        const double factor = D[c * ld + k];
        for (int r = 0; r < m; ++r) column[r] += L[k * ld + r] * factor;
      }
    }
    for (int c = 0; c < m; ++c) {
      for (int r = 0; r < m; ++r) L[c * ld + r] = product[c * m + r];
    }
  }

  /// D ← D⁻¹ by Gauss–Jordan elimination with row pivots.
  static bool Invert(Rows m, double* D, int ld) {
    int swapped[kMaxFixed];
    for (int k = 0; k < m; ++k) {
      double* __restrict pivot_column = D + k * ld;
      int row = k;
      for (int r = k + 1; r < m; ++r) {
        if (std::abs(pivot_column[r]) > std::abs(pivot_column[row])) row = r;
      }
      swapped[k] = row;
      if (row != k) {
        for (int c = 0; c < m; ++c) std::swap(D[c * ld + k], D[c * ld + row]);
      }
      const double pivot = pivot_column[k];
      if (!(std::abs(pivot) > 0)) return false;
      const double inverse = 1 / pivot;
      pivot_column[k] = 1;
      for (int r = 0; r < m; ++r) pivot_column[r] *= r == k ? inverse : -inverse;
      for (int c = 0; c < m; ++c) {
        if (c == k) continue;
        double* __restrict column = D + c * ld;
        const double factor = column[k];
        column[k] = 0;
        for (int r = 0; r < m; ++r) column[r] += factor * pivot_column[r];
      }
    }
    for (int k = m - 1; k >= 0; --k) {
      if (swapped[k] == k) continue;
      for (int r = 0; r < m; ++r) std::swap(D[k * ld + r], D[swapped[k] * ld + r]);
    }
    return true;
  }
};

}  // namespace contact_flow
