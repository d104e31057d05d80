// SPDX-License-Identifier: BSD-3-Clause
#include "row_solve.h"

#include <algorithm>
#include <cmath>

namespace contact_flow {
namespace {

/// Columns that are solved at once: six registers of two.
constexpr int kWidth = 12;
using Row = Eigen::Array<double, kWidth, 1>;
/// Rows of kWidth columns, one behind another.
using Rows = Eigen::Array<double, kWidth, Eigen::Dynamic>;

/// A matrix by what is not zero in its rows.
class SparseRows {
 public:
  /// Of `entry(i, j)`, and j from `first(i)` up to `end(i)`.
  template <class Entry, class First, class End>
  void Fill(int rows, int columns, const Entry& entry, const First& first, const End& end) {
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
  /// Row i of this matrix times B.
  Row Multiply(int i, const Rows& B) const {
    Row sum = Row::Zero();
    for (int e = begin_[i]; e < begin_[i + 1]; ++e) {
      sum += entries_[e].value * B.col(entries_[e].column);
    }
    return sum;
  }

 private:
  struct Entry {
    int column;
    double value;
  };
  std::vector<int> begin_;
  std::vector<Entry> entries_;
};

/// L, upper triangular, and W; scratch that makes room once.
struct Factors {
  Matrix L, W;             // [d×d], [d×k]
  Vector pivots;           // reciprocals of the diagonal of L
  Vector delassus_pivots;  // … and of the factor of WᵀW
  std::vector<int> support;
  SparseRows above, below;    // what is not zero in rows of L and Lᵀ, without the diagonal
  SparseRows reach, reached;  // in rows of W and Wᵀ
  Rows r, y, force;

  void Factorize(const Matrix& M, const Matrix& A) {
    const auto d = static_cast<int>(M.rows()), k = static_cast<int>(A.rows());
    L = M;
    W = A.transpose();
    pivots.resize(d);
    for (int c = d - 1; c >= 0; --c) {
      double* column = L.col(c).data();
      support.clear();
      for (int i = 0; i < c; ++i) {
        if (column[i] != 0) support.push_back(i);
      }
      const double pivot = 1 / std::sqrt(column[c]);
      pivots(c) = pivot;
      for (int i : support) column[i] *= pivot;
      for (int i : support) {
        for (int j : support) {
          if (j > i) break;
          L(j, i) -= column[i] * column[j];
        }
      }
      for (int i = 0; i < k; ++i) {
        double* b = W.col(i).data();
        if (b[c] == 0) continue;
        b[c] *= pivot;
        for (int j : support) b[j] -= column[j] * b[c];
      }
    }
    const auto none = [](int) { return 0; };
    const auto of_L = [&](int i, int j) { return L(i, j); };
    const auto of_Lt = [&](int i, int j) { return L(j, i); };
    above.Fill(
        d, d, of_L, [](int i) { return i + 1; }, [d](int) { return d; });
    below.Fill(d, d, of_Lt, none, [](int i) { return i; });
    reach.Fill(
        d, k, [&](int i, int j) { return W(i, j); }, none, [k](int) { return k; });
    reached.Fill(
        k, d, [&](int i, int j) { return W(j, i); }, none, [d](int) { return d; });
    r.resize(kWidth, d);
    y.resize(kWidth, d);
    force.resize(kWidth, k);
  }
};

/// WᵀW Λ = B, in place.
void SolveDelassus(const Matrix& factor, const Vector& pivots, Rows* B) {
  const auto k = static_cast<int>(factor.rows());
  for (int i = 0; i < k; ++i) {
    Row sum = B->col(i);
    for (int j = 0; j < i; ++j) sum -= factor(i, j) * B->col(j);
    B->col(i) = sum * pivots(i);
  }
  for (int i = k - 1; i >= 0; --i) {
    Row sum = B->col(i);
    for (int j = i + 1; j < k; ++j) sum -= factor(j, i) * B->col(j);
    B->col(i) = sum * pivots(i);
  }
}

/// Columns first … first + count of −`from`, one row behind another; zeros beyond.
void Gather(const GatheredColumns& from, int first, int count, Rows* rows) {
  if (count < kWidth) rows->setZero();
  const int* row = from.rows.data();
  const auto size = static_cast<int>(from.rows.size());
  for (int c = 0; c < count; ++c) {
    const double* column = from.columns[first + c];
    double* out = rows->data() + c;
    for (int i = 0; i < size; ++i, out += kWidth) *out = -column[row[i]];
  }
}

void Scatter(const Rows& rows, int first, int count, Matrix* to) {
  const Eigen::Index size = rows.cols();
  for (int c = 0; c < count; ++c) {
    const double* from = rows.data() + c;
    double* column = to->col(first + c).data();
    for (Eigen::Index i = 0; i < size; ++i, from += kWidth) column[i] = *from;
  }
}

void Solve(Factors* factors, const Matrix& delassus, const GatheredColumns& r1,
           const GatheredColumns& r2, Matrix* X, Matrix* Lambda) {
  Factors& of = *factors;
  const auto d = static_cast<int>(of.W.rows()), k = static_cast<int>(of.W.cols());
  const auto columns = static_cast<int>(r1.columns.size());
  of.delassus_pivots = delassus.diagonal().cwiseInverse();
  for (int first = 0; first < columns; first += kWidth) {
    const int count = std::min(kWidth, columns - first);
    Gather(r1, first, count, &of.y);
    Gather(r2, first, count, &of.force);
    for (int i = d - 1; i >= 0; --i) {  // −Y
      of.y.col(i) = (of.y.col(i) - of.above.Multiply(i, of.y)) * of.pivots(i);
    }
    for (int i = 0; i < k; ++i) of.force.col(i) -= of.reached.Multiply(i, of.y);
    SolveDelassus(delassus, of.delassus_pivots, &of.force);
    for (int i = 0; i < d; ++i) {
      const Row right = of.y.col(i) + of.reach.Multiply(i, of.force);
      of.r.col(i) = (right - of.below.Multiply(i, of.r)) * of.pivots(i);
    }
    Scatter(of.r, first, count, X);
    Scatter(of.force, first, count, Lambda);
  }
}

}  // namespace

void SolveByRows(const Matrix& M, const Matrix& A, const Eigen::LLT<Matrix>& delassus,
                 const GatheredColumns& r1, const GatheredColumns& r2, Matrix* X, Matrix* Lambda) {
  thread_local Factors factors;
  factors.Factorize(M, A);
  Solve(&factors, delassus.matrixLLT(), r1, r2, X, Lambda);
}

}  // namespace contact_flow
