// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// A matrix of which each row keeps what is not zero, so that products cost what is in it. Where
/// that is, copies and those of one Join share, and sums of these are sums of their numbers.
class SparseRows {
 public:
  SparseRows() = default;
  explicit SparseRows(const MatrixRef& matrix);

  Eigen::Index rows() const { return places_ ? places_->rows() : 0; }
  Eigen::Index cols() const { return places_ ? places_->cols : 0; }
  /// Σ_c a_rc w_c.
  double Dot(Eigen::Index r, const VectorRef& w) const {
    double sum = 0;
    for (int e = places_->begin[r]; e < places_->begin[r + 1]; ++e) {
      sum += values_(e) * w(places_->columns[e]);
    }
    return sum;
  }
  /// Σ_c |a_rc w_c|.
  double AbsDot(Eigen::Index r, const VectorRef& w) const {
    double sum = 0;
    for (int e = places_->begin[r]; e < places_->begin[r + 1]; ++e) {
      sum += std::abs(values_(e) * w(places_->columns[e]));
    }
    return sum;
  }
  /// max_c |a_rc|.
  double Largest(Eigen::Index r) const;
  /// w ← w + factor a_rᵀ.
  void AddRow(Eigen::Index r, double factor, Eigen::Ref<Vector> w) const {
    for (int e = places_->begin[r]; e < places_->begin[r + 1]; ++e) {
      w(places_->columns[e]) += factor * values_(e);
    }
  }
  /// w ← w + |a_r|ᵀ.
  void AddAbsRow(Eigen::Index r, Eigen::Ref<Vector> w) const {
    for (int e = places_->begin[r]; e < places_->begin[r + 1]; ++e) {
      w(places_->columns[e]) += std::abs(values_(e));
    }
  }
  Vector operator*(const VectorRef& w) const;
  Matrix Dense() const;

  /// Of the same size, or nothing yet: A ← A + factor B. Cheapest where both are of one Join.
  void Add(double factor, const SparseRows& other);
  /// Makes all, which are of one size, keep the places of each.
  static void Join(const std::vector<SparseRows*>& all);

 private:
  struct Places {
    Eigen::Index rows() const { return static_cast<Eigen::Index>(begin.size()) - 1; }
    bool operator==(const Places& o) const { return begin == o.begin && columns == o.columns; }

    Eigen::Index cols = 0;
    std::vector<int> begin, columns;  // of row r from begin[r] on, increasing
  };
  using Shared = std::shared_ptr<const Places>;
  /// The places of both: one of the two, where it has all.
  static Shared Union(const Shared& a, const Shared& b);
  void MoveTo(const Shared& places);

  Shared places_;
  Vector values_;
};

}  // namespace contact_flow
