// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// Number of coefficient vectors of DOP853's continuous extension (order 7).
inline constexpr int kDenseOrder = 8;

/// The value at θ ∈ [0, 1] of one step's continuous extension, `c` = kDenseOrder vectors [n]:
///   c₀ + θ(c₁ + (1−θ)(c₂ + θ(c₃ + (1−θ)(c₄ + θ(c₅ + (1−θ)(c₆ + θ c₇))))))
/// (Hairer, Nørsett & Wanner, Solving Ordinary Differential Equations I, Sec. II.6).
void EvaluateDenseStep(const double* c, int n, double theta, double* x);

/// The motion along one arc: consecutive steps with their continuous extensions, in one flat store.
class DenseArc {
 public:
  bool Empty() const { return begin_.empty(); }
  std::size_t NumSteps() const { return begin_.size(); }
  double StepBegin(std::size_t k) const { return begin_[k]; }
  double StepLength(std::size_t k) const { return length_[k]; }

  /// The steps that hold [begin, end), and no others: what follows must not change how
  /// the end is read.
  DenseArc Between(double begin, double end) const;

  /// Appends the step (t, t+h] with coefficients c [kDenseOrder×n].
  void Append(double t, double h, const double* c, int n);
  /// Drops the steps that end at t or before.
  void DropBefore(double t);
  /// x(t) [n] into `x`, which must have the right size; t is clamped to the arc.
  void Evaluate(double t, double* x) const;

 private:
  /// The step that holds t: the later one where two meet, the first or last outside.
  std::size_t StepAt(double t) const;

  int n_ = 0;
  std::vector<double> begin_;
  std::vector<double> length_;
  std::vector<double> coefficients_;
};

}  // namespace contact_flow
