// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/event_locator.h"

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>

namespace contact_flow {
namespace {

/// A gap that opens again this many floors above zero cannot be told from one that touches.
constexpr double kTouchReach = 10;
/// A gap that falls by less than this part of a floor before it opens again stands still: a contact
/// that was let go together with others has a speed of the order of rounding.
constexpr double kStandsStill = 1e-3;
constexpr int kPieces = 8;         // of a step, in a search
constexpr int kStageColumns = 16;  // forces kept of one step
constexpr int kEndStage = 12;      // the one at its end
/// A force is excluded by screening when its smallest stage value exceeds this part of its range
/// over the stages. The force of a body at rest may vary in ways that its state, and so the step
/// size, does not see.
constexpr double kForceReserve = 0.5;

/// Root of a function with a sign change in [a, b], to rounding.
template <class Function>
double Root(const Function& f, double a, double b, double fa, double fb) {
  if (fa == 0) return a;
  if (fb == 0) return b;
  boost::uintmax_t iterations = 100;
  const auto bracket = boost::math::tools::toms748_solve(
      f, a, b, fa, fb, boost::math::tools::eps_tolerance<double>(50), iterations);
  return 0.5 * (bracket.first + bracket.second);
}

/// A lower bound of a function on a step of length h, by the Bernstein coefficients of its quintic
/// Hermite interpolant; `error` estimates how far the interpolant is off, by its distance to the
/// cubic one.
double HermiteLowerBound(double h, double g0, double r0, double a0, double g1, double r1, double a1,
                         double* error) {
  const double d0 = h * r0, d1 = h * r1, c0 = h * h * a0, c1 = h * h * a1;
  const double cubic0 = 6 * (g1 - g0) - 4 * d0 - 2 * d1;
  const double cubic1 = -6 * (g1 - g0) + 2 * d0 + 4 * d1;
  *error = std::max(std::abs(c0 - cubic0), std::abs(c1 - cubic1)) / 20;
  return std::min(
      {g0, g0 + d0 / 5, g0 + 2 * d0 / 5 + c0 / 20, g1 - 2 * d1 / 5 + c1 / 20, g1 - d1 / 5, g1});
}

}  // namespace

void SampleGaps(const MechanicalSystem& system, const VectorRef& x, const VectorRef& acceleration,
                ConstraintTerms* terms, GapSample* sample) {
  const int d = system.dof();
  system.Constraints(x.head(system.num_positions()), x.tail(d), terms);
  sample->gap = terms->gap;
  sample->rate.resize(terms->gap.size());
  sample->rate.noalias() = terms->jacobian.lazyProduct(x.tail(d));
  sample->acceleration = terms->bias;
  sample->acceleration.noalias() += terms->jacobian.lazyProduct(acceleration);
}

EventLocator::EventLocator(ContactDynamics* dynamics, double floor)
    : dynamics_(dynamics),
      floor_(floor),
      forces_(dynamics->system().num_constraints(), kStageColumns),
      x_(dynamics->system().state_size()) {}

void EventLocator::RecordForce(const Vector& force) {
  if (calls_ == kStageColumns) return;
  std::copy(force.data(), force.data() + forces_.rows(), &forces_(0, calls_++));
}

void EventLocator::EndStep() {
  if (calls_ == 0) return;
  forces_.col(0) = forces_.col(std::min(calls_ - 1, kEndStage));
  calls_ = 1;
}

bool EventLocator::IsRigidMember(int i) const {
  return mode_.Contains(i) && !dynamics_->system().compliant().Contains(i);
}

/// The guard of constraint i and its time derivative on the continuous extension.
double EventLocator::GuardAt(int i, double theta, double* rate) {
  const MechanicalSystem& system = dynamics_->system();
  stepper_->Interpolate(theta, x_.data());
  if (IsRigidMember(i)) {
    *rate = dynamics_->ForceRate(x_, mode_, i);
    return dynamics_->force()(i);
  }
  system.Constraints(x_.head(system.num_positions()), x_.tail(system.dof()), &terms_);
  *rate = GapSign(i) * terms_.jacobian.row(i).dot(x_.tail(system.dof()));
  return GapSign(i) * terms_.gap(i);
}

void EventLocator::Search(int i, LocatedEvent* event) {
  const bool member = IsRigidMember(i);
  double rate_left = 0, rate_end = 0, unused = 0;
  double left = 0, value_left = GuardAt(i, 0, &rate_left);
  const double floor =
      member ? floor_ * (1 + forces_.row(i).head(kEndStage + 1).cwiseAbs().maxCoeff()) : floor_;
  const auto value_at = [&](double theta) { return GuardAt(i, theta, &unused); };
  const auto rate_at = [&](double theta) {
    double rate;
    GuardAt(i, theta, &rate);
    return rate;
  };
  const auto report = [&](double theta, bool touch) {
    if (theta < event->theta || !event->found) *event = {true, theta, i, touch};
  };
  for (int piece = 1; piece <= kPieces && left < event->theta; ++piece) {
    const double end = static_cast<double>(piece) / kPieces;
    const double value_end = GuardAt(i, end, &rate_end);
    // At most one extremum a piece; the stretch after it (or the whole piece) is where the guard
    // falls.
    double turn = end, value_turn = value_end;
    if (rate_left * rate_end < 0) {
      turn = Root(rate_at, left, end, rate_left, rate_end);
      value_turn = value_at(turn);
    }
    const bool dip = rate_left < 0 && rate_end > 0 && value_left > floor &&
                     value_left - value_turn > kStandsStill * floor;
    const double stops[2] = {turn, end};
    const double values[2] = {value_turn, value_end};
    for (int part = 0; part < 2; ++part) {
      if (values[part] < -floor) {
        const double root =
            value_left <= 0 ? left : Root(value_at, left, stops[part], value_left, values[part]);
        return report(root, false);
      }
      if (part == 0 && dip && !member && value_turn <= kTouchReach * floor) {
        return report(turn, true);
      }
      left = stops[part];
      value_left = values[part];
    }
    if (dip) {
      double& margin = member ? margins_.force : margins_.gap;
      margin = std::min(margin, std::max(value_turn, 0.0));
    }
    rate_left = rate_end;
  }
}

LocatedEvent EventLocator::Locate(Dop853* stepper, ContactMode mode, const GapSample& begin,
                                  const GapSample& end) {
  stepper_ = stepper;
  mode_ = mode;
  LocatedEvent event;
  const double h = stepper->step();
  const int n = dynamics_->system().num_constraints();
  for (int i = 0; i < n; ++i) {
    if (ignored_.Contains(i)) continue;
    if (IsRigidMember(i)) {
      const auto seen = forces_.row(i).head(kEndStage + 1);
      const double lowest = seen.minCoeff(), highest = seen.maxCoeff();
      if (lowest > kForceReserve * (highest - lowest) && lowest > floor_) {
        if (lowest < seen(0) && lowest < seen(kEndStage)) {
          margins_.force = std::min(margins_.force, lowest);
        }
        continue;
      }
      if (!stepper->extended()) stepper->Extend();
      Search(i, &event);
    } else {
      double error = 0;
      const double sign = GapSign(i);
      const double bound = HermiteLowerBound(
          h, sign * begin.gap(i), sign * begin.rate(i), sign * begin.acceleration(i),
          sign * end.gap(i), sign * end.rate(i), sign * end.acceleration(i), &error);
      const bool dips = sign * begin.rate(i) < 0 && sign * end.rate(i) > 0;
      if (bound > error && bound > floor_ && !dips) continue;
      if (!stepper->extended()) stepper->Extend();
      Search(i, &event);
    }
  }
  return event;
}

}  // namespace contact_flow
