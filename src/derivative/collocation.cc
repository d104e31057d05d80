// SPDX-License-Identifier: BSD-3-Clause
#include "collocation.h"

#include <Eigen/LU>
#include <type_traits>

#include "block_solve.h"
#include "contact_flow/fixed_size.h"

namespace contact_flow {

Collocation::Collocation(int d, int k)
    : d_(d),
      k_(k),
      nodes_(d, 2 * d * GaussLegendre::kMaxStages),
      sources_(d, k * GaussLegendre::kMaxStages) {}

bool Collocation::Solve(double h) {
  FindSpans();
  Assemble(h);
  return SolveAccelerations();
}

void Collocation::Propagator(double h, Matrix* step) {
  step->setIdentity(2 * d_ + k_, 2 * d_ + k_);
  step->block(0, d_, d_, d_).diagonal().array() += h;
  AddAccelerations(h * h, rule_->twice_end, step->topRows(d_));
  AddAccelerations(h, rule_->b, step->middleRows(d_, d_));
}

void Collocation::FindSpans() {
  const int stages = rule_->stages, columns = stages * 2 * d_;
  const auto sources = sources_.leftCols(stages * k_);
  if (span_.Holds(nodes_.leftCols(columns), sources)) return;
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
  if (!span_.Holds(nodes_.leftCols(columns), sources)) span_.SetAll(d_);
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
  column_.resize(2 * m);
  for (int unknown = 0; unknown < m; ++unknown) {  // K R and D R
    double* __restrict K = column_.data();
    double* __restrict D = column_.data() + m;
    for (int r = 0; r < 2 * m; ++r) K[r] = 0;
    for (int c = 0; c < d_; ++c) {
      const double factor = rows_.combination()(c, unknown);
      if (factor == 0) continue;
      const double *left = picked_.col(c).data(), *right = picked_.col(d_ + c).data();
      for (int r = 0; r < m; ++r) {
        K[r] += factor * left[r];
        D[r] += factor * right[r];
      }
    }
    for (int j = 0; j < rule_->stages; ++j) {
      double* __restrict block = &system_matrix_(i * m, j * m + unknown);
      const double on_q = -h * h * rule_->twice(i, j), on_v = -h * rule_->a(i, j);
      for (int r = 0; r < m; ++r) block[r] = on_q * K[r] + on_v * D[r];
    }
  }
}

bool Collocation::SolveAccelerations() {
  const int m = rows_.size();
  if (m == 0) return true;
  bool solved = false;
  WithFixedSize(m, [&](auto rows) {
    if constexpr (std::is_same_v<decltype(rows), int>) {
      const Eigen::PartialPivLU<Eigen::Ref<Matrix>> factor(system_matrix_);  // in place
      accelerations_ = factor.solve(accelerations_);
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
      double* __restrict sum = sum_.col(c).data();  // of no row where no acceleration is unknown
      for (int r = 0; r < m; ++r) sum[r] = 0;
      for (int j = 0; j < rule_->stages; ++j) {
        const double* __restrict Z = accelerations_.col(c).data() + j * m;
        const double weight = scale * weights(j);
        for (int r = 0; r < m; ++r) sum[r] += weight * Z[r];
      }
    }
  });
  WithFixedSize(d_, [&](auto d) {
    for (int c = 0; c < all; ++c) {
      double* __restrict out = spread_.col(c).data();
      for (int r = 0; r < d; ++r) out[r] = 0;
      for (int k = 0; k < rows_.size(); ++k) {
        const double factor = sum_(k, c);
        for (int r = 0; r < d; ++r) out[r] += factor * R[k * d + r];
      }
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

void Collocation::Follow(const VectorRef& r) {
  const int columns = columns_.size(), m = rows_.size(), s = rule_->stages;
  start_ = r;
  picked_column_.resize(2 * columns + k_);
  picked_column_.head(columns).noalias() = columns_.combination().transpose() * r.head(d_);
  picked_column_.segment(columns, columns).noalias() =
      columns_.combination().transpose() * r.segment(d_, d_);
  picked_column_.tail(k_) = r.tail(k_);
  followed_.resize(m, s);
  Eigen::Map<Vector>(followed_.data(), m * s).noalias() = accelerations_ * picked_column_;
}

void Collocation::Acceleration(const Vector& weights, Vector* acceleration) const {
  acceleration->noalias() = rows_.combination() * (followed_ * weights);
}

void Collocation::Tangent(double h, const GaussLegendre::Point& point, Vector* tangent) const {
  tangent->resize(2 * d_);
  const auto q = start_.head(d_), v = start_.segment(d_, d_);
  tangent->head(d_) =
      q + point.at * h * v + rows_.combination() * (followed_ * (h * h * point.twice));
  tangent->tail(d_) = v + rows_.combination() * (followed_ * (h * point.once));
}

}  // namespace contact_flow
