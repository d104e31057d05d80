// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

namespace contact_flow {
namespace ros_interface {

/// When an instant of simulated time is due: t is due (t − t₀)/factor seconds after the anchor.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Pace(double factor) : factor_(factor) {}

  /// 0: as fast as possible, everything is due at once.
  double factor() const { return factor_; }
  bool paced() const { return factor_ > 0; }
  /// t [s] is due now, and what follows at `factor` times the speed of the clock.
  void Anchor(double t, double factor) {
    factor_ = factor;
    t_ = t;
    wall_ = Clock::now();
  }
  Clock::time_point Due(double t) const {
    if (!paced()) return wall_;
    return wall_ + std::chrono::duration_cast<Clock::duration>(
                       std::chrono::duration<double>((t - t_) / factor_));
  }
  /// Waits for t without sleeping: a processor that sleeps is not back at once, and one of a
  /// virtual machine perhaps milliseconds later.
  void SpinUntil(double t) const {
    const Clock::time_point due = Due(t);
    while (Clock::now() < due) continue;
  }
  /// How long t has been due [s]; negative before.
  double Lateness(double t) const {
    return paced() ? std::chrono::duration<double>(Clock::now() - Due(t)).count() : 0;
  }

 private:
  double factor_;
  double t_ = 0;
  Clock::time_point wall_ = Clock::now();
};

}  // namespace ros_interface
}  // namespace contact_flow
