// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dop853_tableau.h"
#include "lane_number.h"
#include "lanes.h"

/// Like lane_number.h, for files that are compiled for one instruction set alone.
namespace contact_flow {
namespace {

template <class Model, int W>
class ModelLanes final : public LaneStepper {
  using V = LaneNumber<W>;
  static constexpr int D = Model::kDof, X = 2 * D, N = Model::kConstraints, U = Model::kInputs;
  static_assert(Model::kConstantMass && Model::kAffineConstraints, "maps that depend on the mode");

 public:
  ModelLanes(const double* jacobian, const double* parameters) {
    parameters_.Visit(
        [&](double& field, const char*, const char*, const char*, auto) { field = *parameters++; });
    for (int i = 0; i < N; ++i) {
      for (int k = 0; k < D; ++k) jacobian_[i][k] = jacobian[k * N + i];
    }
    arrays_.width = W;
    arrays_.h = Begin(&h_);
    arrays_.x = Begin(x_);
    arrays_.end = Begin(end_);
    arrays_.stages = Begin(stages_[0]);
    arrays_.forces = Begin(forces_[0]);
    arrays_.errors = Begin(errors_);
    arrays_.factor = Begin(&factor_);
    arrays_.error = Begin(&error_);
    arrays_.stiffness = Begin(&stiffness_);
    arrays_.gap = Begin(gap_);
    arrays_.rate = Begin(rate_);
    arrays_.acceleration = Begin(acceleration_);
    arrays_.dense = Begin(dense_[0]);
    arrays_.u = Begin(u_);
    arrays_.low = Begin(low_);
    arrays_.high = Begin(high_);
    arrays_.sum = Begin(&sum_);
    arrays_.tally = Begin(tally_);
    arrays_.accept = Begin(&accept_);
  }

  void SetMaps(int lane, const double* inverse, const double* force_map) override {
    for (int k = 0; k < D; ++k) {
      for (int i = 0; i < D; ++i) inverse_.Set(i, k, lane, inverse[k * D + i]);
      for (int i = 0; i < N; ++i) force_map_.Set(i, k, lane, force_map[k * N + i]);
    }
  }

  void TryStep(double relative_tolerance, double absolute_tolerance) override {
    tried_ = h_;
    Stages<1>();
    Combine<12>(end_);
    V error5(0.0), error3(0.0);
    for (int i = 0; i < X; ++i) {
      V e5(0.0), e3(0.0);
      for (int k : {0, 5, 6, 7, 8, 9, 10, 11}) {
        e5 += V(dop853::kError5[k]) * stages_[k][i];
        e3 += V(dop853::kA[dop853::kStages][k] - dop853::kError3Minus[k]) * stages_[k][i];
      }
      const V scale = V(absolute_tolerance) + V(relative_tolerance) * max(abs(x_[i]), abs(end_[i]));
      errors_[i] = e5;
      error5 += (e5 / scale) * (e5 / scale);
      error3 += (e3 / scale) * (e3 / scale);
    }
    const V sum = error5 + V(0.01) * error3, length = abs(h_);
    factor_ = length * sqrt(error5 / sum);
    error_ = length * error5 / sqrt(V(double{X}) * sum);
    for (int k = 0; k < W; ++k) {
      if (error5.r[k] == 0) factor_.r[k] = error_.r[k] = 0;
    }
  }

  void Finish() override {
    Field(end_, 12);
    V change(0.0), distance(0.0);
    for (int i = 0; i < X; ++i) {
      const V df = stages_[12][i] - stages_[11][i], dx = end_[i] - scratch_[i];
      change += df * df;
      distance += dx * dx;
    }
    stiffness_ = abs(h_) * sqrt(change / distance);
    Eigen::Matrix<V, D, 1> q;
    Eigen::Matrix<V, N, 1> a;
    for (int i = 0; i < D; ++i) q(i) = end_[i];
    Model::Gaps(parameters_, q, &a);
    for (int i = 0; i < N; ++i) {
      gap_[i] = a(i);
      V rate(0.0), acceleration(0.0);
      for (int k = 0; k < D; ++k) {
        if (jacobian_[i][k] == 0) continue;
        rate += V(jacobian_[i][k]) * end_[D + k];
        acceleration += V(jacobian_[i][k]) * stages_[12][D + k];
      }
      rate_[i] = rate;
      acceleration_[i] = acceleration;
      low_[i] = high_[i] = forces_[0][i];
      for (int stage = 1; stage <= dop853::kStages; ++stage) {
        low_[i] = min(low_[i], forces_[stage][i]);
        high_[i] = max(high_[i], forces_[stage][i]);
      }
    }
    sum_ = error_;
    for (int i = 0; i < X; ++i) sum_ += abs(end_[i]) + abs(stages_[12][i]);
  }

  void Advance() override {
    constexpr double kRounding = 2.220446049250313e-16;
    const auto take = [this](const V& from, V* to) { *to = Where(accept_, from, *to); };
    for (int i = 0; i < D; ++i) take(tally_[i] + tried_ * tally_[D + i], &tally_[i]);
    for (int i = 0; i < X; ++i) {
      const V own = factor_ * abs(errors_[i]) + V(kRounding) * abs(end_[i]);
      take(tally_[i] + own, &tally_[i]);
      take(end_[i], &x_[i]);
      take(stages_[12][i], &stages_[0][i]);
    }
    for (int i = 0; i < N; ++i) take(forces_[12][i], &forces_[0][i]);
  }

  void Extend() override {
    Stages<13>();
    for (int i = 0; i < X; ++i) {
      const V change = end_[i] - x_[i];
      const V bend = h_ * stages_[0][i] - change;
      dense_[0][i] = x_[i];
      dense_[1][i] = change;
      dense_[2][i] = bend;
      dense_[3][i] = change - h_ * stages_[12][i] - bend;
    }
    DenseRow<0>();
    DenseRow<1>();
    DenseRow<2>();
    DenseRow<3>();
  }

 private:
  static double* Begin(V* numbers) { return reinterpret_cast<double*>(numbers); }

  /// A matrix of each lane [rows × D]. Where all lanes have had zeros nothing is multiplied.
  template <int Rows>
  class Maps {
   public:
    void Set(int i, int k, int lane, double value) {
      values_[i][k].r[lane] = value;
      if (value == 0 || used_[i][k]) return;
      used_[i][k] = true;
      counts_[i] = 0;
      for (int j = 0; j < D; ++j) {
        if (used_[i][j]) columns_[i][counts_[i]++] = j;
      }
    }
    V Times(int i, const Eigen::Matrix<V, D, 1>& f) const {
      V sum(0.0);
      for (int e = 0; e < counts_[i]; ++e) {
        const int k = columns_[i][e];
        sum += f(k) * values_[i][k];
      }
      return sum;
    }

   private:
    V values_[Rows][D] = {};
    bool used_[Rows][D] = {};
    int counts_[Rows] = {}, columns_[Rows][D] = {};
  };

  __attribute__((noinline)) void Field(const V* x, int stage) {
    Eigen::Matrix<V, D, 1> q, v, f;
    Eigen::Matrix<V, U, 1> u;
    for (int i = 0; i < D; ++i) q(i) = x[i];
    for (int i = 0; i < D; ++i) v(i) = x[D + i];
    for (int i = 0; i < U; ++i) u(i) = u_[i];
    Model::Force(parameters_, q, v, u, &f);
    V* xdot = stages_[stage];
    for (int i = 0; i < D; ++i) xdot[i] = v(i);
    for (int i = 0; i < D; ++i) xdot[D + i] = inverse_.Times(i, f);
    for (int i = 0; i < N; ++i) forces_[stage][i] = -force_map_.Times(i, f);
  }

  template <int J, int K>
  V WeightedSum(int i) const {
    if constexpr (K < 0) {
      return V(0.0);
    } else if constexpr (dop853::kA[J][K] == 0) {
      return WeightedSum<J, K - 1>(i);
    } else {
      return WeightedSum<J, K - 1>(i) + V(dop853::kA[J][K]) * stages_[K][i];
    }
  }
  template <int J>
  void Combine(V* out) const {
    for (int i = 0; i < X; ++i) out[i] = x_[i] + h_ * WeightedSum<J, J - 1>(i);
  }
  /// Those from J on, up to 11 or 15.
  template <int J>
  void Stages() {
    Combine<J>(scratch_);
    Field(scratch_, J);
    if constexpr (J != 11 && J != 15) Stages<J + 1>();
  }

  template <int R, int K>
  V DenseSum(int i) const {
    if constexpr (K < 0) {
      return V(0.0);
    } else if constexpr (dop853::kDense[R][K] == 0) {
      return DenseSum<R, K - 1>(i);
    } else {
      return DenseSum<R, K - 1>(i) + h_ * V(dop853::kDense[R][K]) * stages_[K][i];
    }
  }
  template <int R>
  void DenseRow() {
    for (int i = 0; i < X; ++i) dense_[4 + R][i] = DenseSum<R, dop853::kAllStages - 1>(i);
  }

  typename Model::template Parameters<double> parameters_;
  double jacobian_[N][D];
  Maps<D> inverse_;
  Maps<N> force_map_;
  V h_ = 0.0, factor_ = 0.0, error_ = 0.0, stiffness_ = 0.0;
  V x_[X] = {}, end_[X] = {}, scratch_[X] = {}, errors_[X] = {};
  V stages_[dop853::kAllStages][X] = {}, forces_[dop853::kAllStages][N] = {};
  V gap_[N] = {}, rate_[N] = {}, acceleration_[N] = {};
  V dense_[8][X] = {}, u_[U + 1] = {};
  V low_[N] = {}, high_[N] = {}, sum_ = 0.0, tally_[X] = {}, accept_ = 0.0, tried_ = 0.0;
};

template <class Model, int W>
LaneStepper* MakeModelLanes(const double* jacobian, const double* parameters) {
  return new ModelLanes<Model, W>(jacobian, parameters);
}

}  // namespace
}  // namespace contact_flow
