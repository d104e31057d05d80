// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <functional>

#include "contact_flow/flow/stepper.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// DOP853: explicit, order 8, error estimate of orders 5 and 3, and on demand a continuous
/// extension of order 7 (Hairer, Nørsett, Wanner I, Sec. II.5, II.6). Autonomous systems ẋ = F(x).
///
/// Nothing allocates after construction. The field is called 11 times by TryStep, once by Begin and
/// by Finish, three times by Extend.
class Dop853 final : public Stepper {
 public:
  /// Writes F(x) [n] to `xdot`; the k-th call since Begin or Advance is stage k.
  using Field = std::function<void(const double* x, double* xdot)>;

  Dop853(int n, Field field);

  void Begin(const Vector& x) override;
  /// (Hairer, Nørsett, Wanner I, Sec. II.4); one call of the field.
  double GuessStep(double relative_tolerance, double absolute_tolerance) override;
  double TryStep(double h, double relative_tolerance, double absolute_tolerance) override;
  void Finish() override;
  void Extend() override;
  void Advance() override;

  /// From now on Finish() estimates h |λ|, λ the dominant eigenvalue of DF (Hairer & Wanner II,
  /// Sec. IV.2).
  void WatchStiffness() { watches_ = true; }
  /// The estimate: stability limits the steps where it is beyond kStable again and again.
  double stiffness() const { return stiffness_; }
  static constexpr double kStable = 6.1;

 private:
  double* stage(int k) { return stages_.data() + k * n_; }
  const double* stage(int k) const { return stages_.data() + k * n_; }
  template <int J>
  void Combine(double* out) const;
  template <int J>
  void EvaluateStage();

  const Field field_;
  Vector scratch_;
  Vector stages_;  // 16 derivatives, contiguous
  bool watches_ = false;
  double stiffness_ = 0;
};

}  // namespace contact_flow
