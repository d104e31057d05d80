// SPDX-License-Identifier: BSD-3-Clause
#include "collocation.h"

#include <algorithm>
#include <type_traits>

#include "block_solve.h"
#include "contact_flow/fixed_size.h"
#include "dense_solve.h"

namespace contact_flow {

Collocation::Collocation(int d, int k)
    : d_(d),
      k_(k),
      nodes_(d, 2 * d * CollocationRule::kMaxStages),
      sources_(d, k * CollocationRule::kMaxStages) {}

bool Collocation::Solve(double h) {
  FindSpans(h);
  Assemble(h);
  return SolveAccelerations();
}

void Collocation::Propagator(double h, Matrix* step) {
  step->setIdentity(2 * d_ + k_, 2 * d_ + k_);
  step->block(0, d_, d_, d_).diagonal().array() += h;
  AddAccelerations(h * h, rule_->twice_end, step->topRows(d_));
  AddAccelerations(h, rule_->b, step->middleRows(d_, d_));
}

double Collocation::Reach(double h) const {
  double reach = 0;
  for (int i = 0; i < rule_->stages; ++i) {
    const auto K = nodes_.middleCols(2 * d_ * i, d_), D = nodes_.middleCols(2 * d_ * i + d_, d_);
    reach = std::max(reach, h * h * K.cwiseAbs().maxCoeff() + h * D.cwiseAbs().maxCoeff());
  }
  return reach;
}

void Collocation::FindSpans(double h) {
  const int stages = rule_->stages, columns = stages * 2 * d_;
  const auto nodes = nodes_.leftCols(columns);
  const auto sources = sources_.leftCols(stages * k_);
  const double largest = nodes.cwiseAbs().maxCoeff();
  if ((h + h * h) * largest > quick_ && Reach(h) > quick_) {
    span_.SetAll(d_);
    kept_all_ = true;
    return;
  }
  if (!kept_all_ && span_.Holds(nodes, largest, sources)) return;
  kept_all_ = false;
  // Two mixtures: where a single [K D] has few rows, its columns depend on each other by chance.
  sample_.setZero(d_, 4 * d_);
  for (int i = 0; i < stages; ++i) {
    sample_.leftCols(2 * d_) += rule_->c(i) * Node(i);
    sample_.rightCols(2 * d_) += (1 - rule_->c(i)) * Node(i);
  }
  source_sample_.setZero(d_, 2 * k_);
  for (int i = 0; i < stages && k_ > 0; ++i) {
    source_sample_.leftCols(k_) += rule_->c(i) * Source(i);
    source_sample_.rightCols(k_) += (1 - rule_->c(i)) * Source(i);
  }
  span_.Find(sample_, source_sample_);
  if (!span_.Holds(nodes, largest, sources)) span_.SetAll(d_);
}

void Collocation::Assemble(double h) {
  const int s = rule_->stages, m = rows_.size(), n = s * m;
  system_matrix_.resize(n, n);
  accelerations_.resize(n, 2 * columns_.size() + k_);
  WithFixedSize(m, [&](auto rows) {
    for (int i = 0; i < s; ++i) AssembleNode(i, h, rows);
  });
  for (int i = 0; i < s; ++i) {
    for (int c = 0; c < k_; ++c) {
      for (int r = 0; r < m; ++r) {
        accelerations_(i * m + r, 2 * columns_.size() + c) = Source(i)(rows_.members()[r], c);
      }
    }
  }
  system_matrix_.diagonal().array() += 1;
}

template <class Rows>
void Collocation::AssembleNode(int i, double h, Rows m) {
  const double* node = Node(i).data();
  const double ahead = rule_->c(i) * h;
  picked_.resize(m, 2 * d_);
  for (int c = 0; c < 2 * d_; ++c) {
    for (int r = 0; r < m; ++r) picked_(r, c) = node[c * d_ + rows_.members()[r]];
  }
  for (int l = 0; l < columns_.size(); ++l) {
    const int c = columns_.members()[l];
    const double *K = picked_.col(c).data(), *D = picked_.col(d_ + c).data();
    double* __restrict q = accelerations_.col(l).data() + i * m;
    double* __restrict v = accelerations_.col(columns_.size() + l).data() + i * m;
    for (int r = 0; r < m; ++r) {
      q[r] = K[r];
      v[r] = D[r] + ahead * K[r];
    }
  }
  on_positions_.resize(m, m);
  on_velocities_.resize(m, m);
  for (int unknown = 0; unknown < m; ++unknown) {
    double *K = on_positions_.col(unknown).data(), *D = on_velocities_.col(unknown).data();
    ColumnSum positions(m, K), velocities(m, D);
    for (int c = 0; c < d_; ++c) {
      const double factor = rows_.combination()(c, unknown);
      if (factor == 0) continue;
      positions.Add(factor, picked_.col(c).data());
      velocities.Add(factor, picked_.col(d_ + c).data());
    }
    positions.WriteTo(K);
    velocities.WriteTo(D);
  }
  for (int j = 0; j < rule_->stages; ++j) {
    const double on_q = -h * h * rule_->twice(i, j), on_v = -h * rule_->a(i, j);
    for (int unknown = 0; unknown < m; ++unknown) {
      double* block = &system_matrix_(i * m, j * m + unknown);
      ColumnSum entries(m, block);
      entries.Add(on_q, on_positions_.col(unknown).data());
      entries.Add(on_v, on_velocities_.col(unknown).data());
      entries.WriteTo(block);
    }
  }
}

bool Collocation::SolveAccelerations() {
  const int m = rows_.size();
  if (m == 0) return true;
  bool solved = false;
  WithFixedSize(m, [&](auto rows) {
    if constexpr (std::is_same_v<decltype(rows), int>) {
      SolveDense(&system_matrix_, &accelerations_);
      solved = true;
    } else {
      solved =
          BlockSolve<decltype(rows)>::Run(rows, rule_->stages, &system_matrix_, &accelerations_);
    }
  });
  return solved;
}

void Collocation::AddAccelerations(double scale, const Vector& weights, Eigen::Ref<Matrix> target) {
  const int columns = columns_.size();
  const double* R = rows_.combination().data();
  const int all = 2 * columns + k_;
  sum_.resize(rows_.size(), all);
  spread_.resize(d_, all);
  WithFixedSize(rows_.size(), [&](auto m) {
    for (int c = 0; c < all; ++c) {
      double* out = sum_.col(c).data();  // of no row where no acceleration is unknown
      ColumnSum sum(m, out);
      for (int j = 0; j < rule_->stages; ++j) {
        sum.Add(scale * weights(j), accelerations_.col(c).data() + j * m);
      }
      sum.WriteTo(out);
    }
  });
  WithFixedSize(d_, [&](auto d) {
    for (int c = 0; c < all; ++c) {
      double* out = spread_.col(c).data();
      ColumnSum sum(d, out);
      for (int k = 0; k < rows_.size(); ++k) sum.Add(sum_(k, c), R + k * d);
      sum.WriteTo(out);
    }
  });
  WithFixedSize(d_, [&](auto d) {
    for (int c = 0; c < 2 * d; ++c) {
      const int half = c / d;
      double* __restrict out = &target(0, c);
      for (int l = 0; l < columns; ++l) {
        const double factor = columns_.combination()(c % d, l);
        if (factor == 0) continue;
        const double* __restrict in = &spread_(0, half * columns + l);
        for (int r = 0; r < d; ++r) out[r] += factor * in[r];
      }
    }
  });
  if (k_ > 0) target.rightCols(k_) += spread_.rightCols(k_);
}

// The products below are of a few rows and one column: lazyProduct neither allocates nor packs.

void Collocation::Follow(const VectorRef& r) {
  const int columns = columns_.size(), m = rows_.size(), s = rule_->stages;
  const auto picked = columns_.combination().transpose();
  start_ = r;
  picked_column_.resize(2 * columns + k_);
  picked_column_.head(columns).noalias() = picked.lazyProduct(r.head(d_));
  picked_column_.segment(columns, columns).noalias() = picked.lazyProduct(r.segment(d_, d_));
  picked_column_.tail(k_) = r.tail(k_);
  followed_.resize(m, s);
  Eigen::Map<Vector>(followed_.data(), m * s).noalias() = accelerations_ * picked_column_;
}

void Collocation::Acceleration(const Vector& weights, Vector* acceleration) {
  mixed_.noalias() = followed_.lazyProduct(weights);
  acceleration->noalias() = rows_.combination().lazyProduct(mixed_);
}

void Collocation::Tangent(double h, const CollocationRule::Point& point, Vector* tangent) {
  const auto q = start_.head(d_), v = start_.segment(d_, d_);
  tangent->resize(2 * d_);
  Acceleration(point.twice, &integral_);
  tangent->head(d_) = q + point.at * h * v + h * h * integral_;
  Acceleration(point.once, &integral_);
  tangent->tail(d_) = v + h * integral_;
}

}  // namespace contact_flow
