// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <boost/numeric/odeint.hpp>
#include <cmath>

#include "hybrid_system.h"
#include "peer.h"

namespace contact_flow {
namespace benchmark {
namespace {

namespace odeint = boost::numeric::odeint;
using State = std::array<double, kStates>;

constexpr int kMaxConstraints = 8;
constexpr double kFirstStep = 0.6;     // [s] times tolerance^(1/order)
constexpr double kTaylorReach = 1e-9;  // [s] the last correction of an event time is a Taylor step
constexpr int kMaxNewton = 20;

/// A controlled stepper of odeint. A step at whose end a gap is negative is repeated from its
/// beginning with the length as the unknown: Newton's method from the root of the gap's cubic
/// interpolant, kept in the bracket.
template <class Stepper>
class Odeint : public Peer {
 public:
  Odeint(const Scenario& scenario, std::string name, int order)
      : scenario_(scenario), hybrid_(scenario), name_(std::move(name)), order_(order) {}

  std::string name() const override { return name_; }

  RunResult Run(double tolerance) override {
    const auto field = [this](const State& x, State& xdot, double) {
      hybrid_.Field(x.data(), xdot.data());
    };
    auto stepper = odeint::make_controlled(tolerance, tolerance, Stepper());
    Stepper locating;
    const double first_step = kFirstStep * std::pow(tolerance, 1.0 / order_);
    const int n = hybrid_.num_constraints();
    hybrid_.Reset();
    State x, x_begin;
    std::copy(scenario_.x.data(), scenario_.x.data() + kStates, x.begin());
    double t = 0, dt = first_step;
    std::array<double, kMaxConstraints> gap, rate, gap_begin, rate_begin;
    hybrid_.Gaps(x.data(), gap_begin.data(), rate_begin.data());
    while (t < scenario_.duration) {
      const double t_begin = t, rest = scenario_.duration - t;
      dt = std::min(dt, rest);
      const bool last = dt == rest;
      x_begin = x;
      if (stepper.try_step(field, x, t, dt) == odeint::fail) continue;
      if (last) t = scenario_.duration;
      hybrid_.Gaps(x.data(), gap.data(), rate.data());
      int trigger = -1;
      double earliest = t - t_begin;
      for (int i = 0; i < n; ++i) {
        if (gap[i] >= 0) continue;
        const double guess = CubicRoot(t - t_begin, gap_begin[i], rate_begin[i], gap[i], rate[i]);
        if (trigger < 0 || guess < earliest) {
          trigger = i;
          earliest = guess;
        }
      }
      if (trigger >= 0) {
        t = t_begin + Locate(&locating, field, x_begin, trigger, t - t_begin, earliest, &x);
        hybrid_.Pass(t, trigger, x.data());
        stepper = odeint::make_controlled(tolerance, tolerance, Stepper());
        dt = first_step;
        hybrid_.Gaps(x.data(), gap.data(), rate.data());
      }
      gap_begin = gap;
      rate_begin = rate;
    }
    return {Eigen::Map<const Eigen::Matrix<double, kStates, 1>>(x.data()),
            hybrid_.right_hand_sides()};
  }

 private:
  /// Root in [0, h] of the cubic with the given values and slopes, g0 > 0 > g1.
  static double CubicRoot(double h, double g0, double r0, double g1, double r1) {
    const double d0 = h * r0, d1 = h * r1;
    const double a = 2 * (g0 - g1) + d0 + d1, b = 3 * (g1 - g0) - 2 * d0 - d1;
    double low = 0, high = 1, s = g0 / (g0 - g1);
    for (int k = 0; k < 30; ++k) {
      const double value = g0 + s * (d0 + s * (b + s * a));
      (value > 0 ? low : high) = s;
      double next = s - value / (d0 + s * (2 * b + s * 3 * a));
      if (!(next > low && next < high)) next = 0.5 * (low + high);
      if (std::abs(next - s) < 1e-12) break;
      s = next;
    }
    return s * h;
  }

  /// Repeats the step from x_begin until it ends on the guard; returns its length.
  template <class Field>
  double Locate(Stepper* stepper, const Field& field, const State& x_begin, int trigger, double h,
                double guess, State* x) {
    State begin_field, end_field;
    field(x_begin, begin_field, 0);
    std::array<double, kMaxConstraints> gap, rate;
    double low = 0, high = h, s = guess;
    for (int k = 0; k < kMaxNewton; ++k) {
      Restep(stepper, field, x_begin, begin_field, s, x, &end_field);
      hybrid_.Gaps(x->data(), gap.data(), rate.data());
      (gap[trigger] > 0 ? low : high) = s;
      const double correction = -gap[trigger] / rate[trigger];
      if (std::abs(correction) <= kTaylorReach) {
        field(*x, end_field, s);
        for (int i = 0; i < kStates; ++i) (*x)[i] += correction * end_field[i];
        return s + correction;
      }
      s += correction;
      if (!(s > low && s < high)) s = 0.5 * (low + high);
    }
    return s;
  }

  template <class Field>
  static void Restep(Stepper* stepper, const Field& field, const State& x_begin,
                     const State& begin_field, double s, State* x, State* end_field) {
    if constexpr (std::is_same_v<typename Stepper::stepper_category,
                                 odeint::explicit_error_stepper_fsal_tag>) {
      stepper->do_step(field, x_begin, begin_field, 0.0, *x, *end_field, s);
    } else {
      stepper->do_step(field, x_begin, begin_field, 0.0, *x, s);
    }
  }

  const Scenario& scenario_;
  HybridSystem hybrid_;
  const std::string name_;
  const int order_;
};

}  // namespace

std::unique_ptr<Peer> MakeOdeintFehlberg78(const Scenario& scenario) {
  using Stepper =
      odeint::runge_kutta_fehlberg78<State, double, State, double, odeint::array_algebra>;
  return std::make_unique<Odeint<Stepper>>(scenario, "odeint fehlberg78", 8);
}

std::unique_ptr<Peer> MakeOdeintDopri5(const Scenario& scenario) {
  using Stepper = odeint::runge_kutta_dopri5<State, double, State, double, odeint::array_algebra>;
  return std::make_unique<Odeint<Stepper>>(scenario, "odeint dopri5", 5);
}

}  // namespace benchmark
}  // namespace contact_flow
