// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/sparse_rows.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace contact_flow {

SparseRows::SparseRows(const MatrixRef& matrix) {
  auto places = std::make_shared<Places>();
  places->cols = matrix.cols();
  const Eigen::Index count = (matrix.array() != 0).count();
  places->begin.reserve(static_cast<std::size_t>(matrix.rows()) + 1);
  places->columns.reserve(static_cast<std::size_t>(count));
  values_.resize(count);
  int place = 0;
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    places->begin.push_back(place);
    for (int c = 0; c < matrix.cols(); ++c) {
      if (matrix(r, c) == 0) continue;
      places->columns.push_back(c);
      values_(place++) = matrix(r, c);
    }
  }
  places->begin.push_back(place);
  places_ = std::move(places);
}

double SparseRows::Largest(Eigen::Index r) const {
  double largest = 0;
  for (int e = places_->begin[r]; e < places_->begin[r + 1]; ++e) {
    largest = std::max(largest, std::abs(values_(e)));
  }
  return largest;
}

Vector SparseRows::operator*(const VectorRef& w) const {
  Vector product(rows());
  for (Eigen::Index r = 0; r < rows(); ++r) product(r) = Dot(r, w);
  return product;
}

Matrix SparseRows::Dense() const {
  Matrix matrix = Matrix::Zero(rows(), cols());
  for (Eigen::Index r = 0; r < rows(); ++r) {
    for (int e = places_->begin[r]; e < places_->begin[r + 1]; ++e) {
      matrix(r, places_->columns[e]) = values_(e);
    }
  }
  return matrix;
}

SparseRows::Shared SparseRows::Union(const Shared& a, const Shared& b) {
  if (a == b) return a;
  Places both;
  both.cols = a->cols;
  for (Eigen::Index r = 0; r < a->rows(); ++r) {
    both.begin.push_back(static_cast<int>(both.columns.size()));
    const auto row = [r](const Shared& of, int after) {
      return of->columns.begin() + of->begin[r + after];
    };
    std::set_union(row(a, 0), row(a, 1), row(b, 0), row(b, 1), std::back_inserter(both.columns));
  }
  both.begin.push_back(static_cast<int>(both.columns.size()));
  if (both == *b) return b;
  if (both == *a) return a;
  return std::make_shared<const Places>(std::move(both));
}

void SparseRows::MoveTo(const Shared& places) {
  if (places_ == places) return;
  Vector values = Vector::Zero(static_cast<Eigen::Index>(places->columns.size()));
  for (Eigen::Index r = 0; r < rows(); ++r) {
    int at = places->begin[r];
    for (int e = places_->begin[r]; e < places_->begin[r + 1]; ++e) {
      while (places->columns[at] != places_->columns[e]) ++at;
      values(at) = values_(e);
    }
  }
  values_ = std::move(values);
  places_ = places;
}

void SparseRows::Add(double factor, const SparseRows& other) {
  if (places_ == other.places_) {
    values_ += factor * other.values_;
    return;
  }
  if (!places_) {
    places_ = other.places_;
    values_ = factor * other.values_;
    return;
  }
  const Shared places = Union(places_, other.places_);
  SparseRows moved = other;
  moved.MoveTo(places);
  MoveTo(places);
  values_ += factor * moved.values_;
}

void SparseRows::Join(const std::vector<SparseRows*>& all) {
  if (all.empty()) return;
  Shared places = all.front()->places_;
  for (const SparseRows* rows : all) places = Union(places, rows->places_);
  for (SparseRows* rows : all) rows->MoveTo(places);
}

}  // namespace contact_flow
