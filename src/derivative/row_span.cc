// SPDX-License-Identifier: BSD-3-Clause
#include "row_span.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "contact_flow/fixed_size.h"

namespace contact_flow {
namespace {

/// Part of the largest entry below which a sample has nothing to say. Less than kRounding: what one
/// sample takes for nothing must not exceed rounding in another.
constexpr double kNothing = 1e-14;

/// The largest entry of the columns from `first` on, and where: the first of those that are equal.
double Largest(const Matrix& W, int first, int* row, int* column) {
  double largest = 0;
  WithFixedSize(static_cast<int>(W.rows()), [&](auto rows) {
    for (int c = first; c < W.cols(); ++c) {
      const double* entry = W.col(c).data();
      double most = std::abs(entry[0]);
      for (int r = 1; r < rows; ++r) most = std::max(most, std::abs(entry[r]));
      if (!(most > largest)) continue;
      largest = most;
      *column = c;
    }
  });
  if (largest > 0) *row = 0;
  while (largest > 0 && std::abs(W(*row, *column)) != largest) ++*row;
  return largest;
}

/// Makes row p 1 in column `pivot` and 0 in all others, by adding multiples of that column to them.
void Eliminate(int p, int pivot, Matrix* W) {
  WithFixedSize(static_cast<int>(W->rows()), [&](auto rows) {
    double* __restrict unit = W->col(pivot).data();
    const double scale = unit[p];
    for (int r = 0; r < rows; ++r) unit[r] /= scale;
    for (int c = 0; c < W->cols(); ++c) {
      double* __restrict column = W->col(c).data();
      const double factor = column[p];
      if (c == pivot || factor == 0) continue;
      for (int r = 0; r < rows; ++r) column[r] -= factor * unit[r];
      column[p] = 0;
    }
  });
}

}  // namespace

void RowSpan::SetAll(int rows) {
  members_.resize(rows);
  std::iota(members_.begin(), members_.end(), 0);
  dependent_.clear();
  combination_.setIdentity(rows, rows);
}

void RowSpan::Find(Matrix* sample) {
  Matrix& W = *sample;
  const int rows = static_cast<int>(W.rows()), columns = static_cast<int>(W.cols());
  members_.clear();
  double zero = 0;
  // In the end the columns of the pivots combine the members.
  for (int rank = 0; rank < std::min(rows, columns); ++rank) {
    int p = 0, pivot = rank;
    const double largest = Largest(W, rank, &p, &pivot);
    if (rank == 0) zero = kNothing * largest;
    if (!(largest > zero)) break;
    members_.push_back(p);
    W.col(pivot).swap(W.col(rank));
    Eliminate(p, rank, &W);
  }
  combination_ = W.leftCols(size());
  combination_ = (combination_.array().abs() > kNothing).select(combination_, 0);
  FindDependent();
}

void RowSpan::FindDependent() {
  dependent_.clear();
  for (int i = 0; i < combination_.rows(); ++i) {
    if (std::find(members_.begin(), members_.end(), i) == members_.end()) dependent_.push_back(i);
  }
}

bool RowSpan::Holds(const double* data, int row_stride, int length, int stride, double zero) const {
  constexpr int kChunk = 16;
  double defect[kChunk];
  for (int i : dependent_) {
    for (int begin = 0; begin < length; begin += kChunk) {
      const double* entry = data + begin * stride;
      const int count = std::min(kChunk, length - begin);
      for (int k = 0; k < count; ++k) defect[k] = entry[i * row_stride + k * stride];
      for (int l = 0; l < size(); ++l) {
        const double factor = combination_(i, l);
        if (factor == 0) continue;
        const double* member = entry + members_[l] * row_stride;
        for (int k = 0; k < count; ++k) defect[k] -= factor * member[k * stride];
      }
      for (int k = 0; k < count; ++k) {
        if (!(std::abs(defect[k]) <= zero)) return false;
      }
    }
  }
  return true;
}

void JacobianSpan::SetAll(int d) {
  rows_.SetAll(d);
  columns_.SetAll(d);
}

void JacobianSpan::Find(const MatrixRef& sample, const MatrixRef& sources) {
  const Eigen::Index d = sample.rows();
  scratch_.resize(d, sample.cols() + sources.cols());
  scratch_ << sample, sources;
  if (sources.cols() > 0) {  // on one scale, or what is small in one is nothing beside the other
    const double large = sources.cwiseAbs().maxCoeff(), other = sample.cwiseAbs().maxCoeff();
    if (large > 0 && other > 0) scratch_.rightCols(sources.cols()) *= other / large;
  }
  rows_.Find(&scratch_);
  scratch_.resize(d, sample.cols());
  for (Eigen::Index half = 0; half < sample.cols(); half += d) {
    scratch_.middleCols(half, d) = sample.middleCols(half, d).transpose();
  }
  columns_.Find(&scratch_);
}

bool JacobianSpan::Holds(const MatrixRef& nodes, double largest, const MatrixRef& sources) const {
  const int d = static_cast<int>(nodes.rows()), count = static_cast<int>(nodes.cols());
  const double zero = RowSpan::kRounding * largest;
  if (!rows_.Holds(nodes.data(), 1, count, d, zero)) return false;
  if (sources.cols() > 0) {
    const double nothing = RowSpan::kRounding * sources.cwiseAbs().maxCoeff();
    const int others = static_cast<int>(sources.cols());
    if (!rows_.Holds(sources.data(), 1, others, d, nothing)) return false;
  }
  for (int half = 0; half < count; half += d) {
    if (!columns_.Holds(nodes.data() + half * d, d, d, 1, zero)) return false;
  }
  return true;
}

}  // namespace contact_flow
