// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/reference_flow.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace adversary {
namespace {

constexpr std::array<int, 6> kMidpoints = {2, 4, 6, 8, 10, 12};

/// The quintic with values, velocities and accelerations at both ends, at θ ∈ [0, 1].
void Quintic(const Vector& x, const SmallVector& ax, const Vector& y, const SmallVector& ay,
             double h, double theta, SmallState* z) {
  const Eigen::Index d = ax.size();
  const double t = theta, t2 = t * t, t3 = t2 * t, t4 = t3 * t, t5 = t4 * t;
  const double p0 = 1 - 10 * t3 + 15 * t4 - 6 * t5, p1 = 10 * t3 - 15 * t4 + 6 * t5;
  const double v0 = t - 6 * t3 + 8 * t4 - 3 * t5, v1 = -4 * t3 + 7 * t4 - 3 * t5;
  const double a0 = 0.5 * (t2 - 3 * t3 + 3 * t4 - t5), a1 = 0.5 * (t3 - 2 * t4 + t5);
  const double dp = (-30 * t2 + 60 * t3 - 30 * t4) / h;
  const double dv0 = 1 - 18 * t2 + 32 * t3 - 15 * t4, dv1 = -12 * t2 + 28 * t3 - 15 * t4;
  const double da0 = 0.5 * (2 * t - 9 * t2 + 12 * t3 - 5 * t4) * h;
  const double da1 = 0.5 * (3 * t2 - 8 * t3 + 5 * t4) * h;
  z->resize(2 * d);
  z->head(d) = p0 * x.head(d) + p1 * y.head(d) + h * (v0 * x.tail(d) + v1 * y.tail(d)) +
               h * h * (a0 * ax + a1 * ay);
  z->tail(d) =
      dp * (x.head(d) - y.head(d)) + dv0 * x.tail(d) + dv1 * y.tail(d) + da0 * ax + da1 * ay;
}

}  // namespace

SmallState ReferenceFlow::Field(const SmallState& x) {
  dynamics_.Solve(x, u_, mode_);
  SmallState field(x.size());
  field << x.tail(system_.dof()), dynamics_.acceleration();
  return field;
}

double ReferenceFlow::Limit(const Vector& x) const {
  const int d = system_.dof();
  const double scale = system_.TimeScale(x.head(d), x.tail(d));
  return std::min(options_.largest_step, options_.feature * scale);
}

double ReferenceFlow::Step(const Vector& x, double h, Vector* y) {
  std::array<SmallState, kMidpoints.size()> table;
  const SmallState start = Field(x);
  double error = std::numeric_limits<double>::infinity();
  const double scale = std::max(1.0, x.cwiseAbs().maxCoeff());
  for (std::size_t j = 0; j < kMidpoints.size(); ++j) {
    const int n = kMidpoints[j];
    const double step = h / n;
    SmallState before = x, now = x + step * start;
    for (int k = 1; k < n; ++k) {
      const SmallState next = before + 2 * step * Field(now);
      before = now;
      now = next;
    }
    table[j] = 0.5 * (now + before + step * Field(now));
    for (std::size_t k = j; k > 0; --k) {
      const double ratio = static_cast<double>(n) / kMidpoints[k - 1];
      table[k - 1] = table[k] + (table[k] - table[k - 1]) / (ratio * ratio - 1);
    }
    if (j > 0) error = (table[0] - table[1]).cwiseAbs().maxCoeff() / scale;
    if (j > 2 && error <= options_.tolerance) break;
  }
  *y = table[0];
  return error;
}

bool ReferenceFlow::Glide(Vector* x, const Vector& u, ConstraintSet mode, double duration) {
  u_ = u;
  mode_ = mode;
  const double sign = duration < 0 ? -1 : 1;
  double done = 0, h = options_.largest_step;
  const double whole = std::abs(duration);
  for (long k = 0; done < whole; ++k) {
    if (k > options_.max_steps || !x->allFinite()) return false;
    Vector towards = *x;
    towards.tail(system_.dof()) *= sign;
    const double length = std::min({h, Limit(towards), whole - done});
    Vector y;
    const double error = Step(*x, sign * length, &y);
    if (!(error <= 10 * options_.tolerance) && length > 1e-9) {
      h = 0.5 * length;
      continue;
    }
    *x = y;
    done += length;
    h = 1.5 * std::max(length, h);
  }
  return x->allFinite();
}

double ReferenceFlow::Guard(const VectorRef& x, int i) {
  const int d = system_.dof();
  if (mode_.Contains(i)) {
    dynamics_.Solve(x, u_, mode_);
    return dynamics_.force()(i);
  }
  system_.Constraints(x.head(d), x.tail(d), &terms_);
  return terms_.gap(i);
}

ReferenceFlow::Event ReferenceFlow::FirstEvent(const Vector& x, const Vector& y, double h,
                                               ReferenceRun* run) {
  const int d = system_.dof(), n = system_.num_constraints();
  dynamics_.Solve(x, u_, mode_);
  const SmallVector ax = dynamics_.acceleration();
  dynamics_.Solve(y, u_, mode_);
  const SmallVector ay = dynamics_.acceleration();
  const auto at = [&](double s) {
    SmallState z;
    Quintic(x, ax, y, ay, h, s / h, &z);
    return z;
  };
  constexpr int kSamples = 6;
  std::array<SmallVector, kSamples + 1> value, rate;
  double largest_force = 0;
  for (int k = 0; k <= kSamples; ++k) {
    SmallState z = x;
    if (k > 0) z = k == kSamples ? SmallState(y) : at(h * k / kSamples);
    if (!mode_.Empty()) dynamics_.Solve(z, u_, mode_);
    system_.Constraints(z.head(d), z.tail(d), &terms_);
    value[k] = terms_.gap;
    rate[k] = terms_.jacobian.lazyProduct(z.tail(d));
    for (int i : mode_) value[k](i) = dynamics_.force()(i);
    if (!mode_.Empty()) {
      largest_force = std::max(largest_force, dynamics_.force().cwiseAbs().maxCoeff());
    }
  }
  Event first;
  first.s = std::numeric_limits<double>::infinity();
  const auto offer = [&](int i, double low, double high) {
    // value(low) ≥ 0 > value(high): bisection on the quintic.
    for (int k = 0; k < 45 && high - low > 1e-12 * h; ++k) {
      const double middle = 0.5 * (low + high);
      (Guard(at(middle), i) < 0 ? high : low) = middle;
    }
    if (high < first.s) first = {high, i};
  };
  for (int i = 0; i < n; ++i) {
    const bool held = mode_.Contains(i);
    for (int k = 0; k < kSamples; ++k) {
      const double low = h * k / kSamples, high = h * (k + 1) / kSamples;
      if (low > first.s) break;
      const double noise = held ? 1e-12 * std::max(1.0, largest_force) : 1e-14;
      if (value[k + 1](i) < -noise) {
        // What touches at the beginning of the arc counts as open there.
        offer(i, low, high);
        break;
      }
      // A dip inside: the smallest value of a parabola, or where the rate changes sign.
      double bottom = -1;
      if (held) {
        if (k == 0) continue;
        const double a = value[k - 1](i), b = value[k](i), c = value[k + 1](i);
        if (!(b < a && b < c)) continue;
        const double left = h * (k - 1) / kSamples;
        double l = left, r = high;
        for (int j = 0; j < 40; ++j) {
          const double m1 = l + 0.382 * (r - l), m2 = l + 0.618 * (r - l);
          (Guard(at(m1), i) < Guard(at(m2), i) ? r : l) =
              Guard(at(m1), i) < Guard(at(m2), i) ? m2 : m1;
        }
        bottom = 0.5 * (l + r);
        if (Guard(at(bottom), i) < 0) {
          offer(i, left, bottom);
          break;
        }
        continue;
      }
      if (!(rate[k](i) < 0 && rate[k + 1](i) > 0)) continue;
      double l = low, r = high;
      for (int j = 0; j < 45; ++j) {
        const double m = 0.5 * (l + r);
        const SmallState z = at(m);
        system_.Constraints(z.head(d), z.tail(d), &terms_);
        (terms_.jacobian.row(i).dot(z.tail(d)) < 0 ? l : r) = m;
      }
      bottom = 0.5 * (l + r);
      const double depth = Guard(at(bottom), i);
      if (depth < 0) {
        offer(i, low, bottom);
        break;
      }
      run->gap = std::min(run->gap, depth);
    }
  }
  return first;
}

void ReferenceFlow::Resolve(Vector* x, int trigger, double t, ReferenceRun* run) {
  const int d = system_.dof(), n = system_.num_constraints();
  ReferenceEvent event;
  event.t = t;
  event.before = mode_;
  system_.Constraints(x->head(d), x->tail(d), &terms_);
  const ConstraintTerms terms = terms_;
  const Vector rate = terms.jacobian * x->tail(d);
  ConstraintSet near;
  for (int i = 0; i < n; ++i) {
    if (mode_.Contains(i)) continue;
    // What approaches slowly may be far in time.
    const double small = rate(i) < -kRest ? kRounding - 2 * kGap * rate(i) : 2 * kGap;
    if (i != trigger && terms.gap(i) > small) continue;
    if (rate(i) < -kRest) {
      event.activated.Insert(i);
      run->approach = std::min(run->approach, -rate(i));
    } else if (i == trigger || rate(i) <= kRest) {
      if (rate(i) > kRest) run->lost = std::max(run->lost, rate(i));
      near.Insert(i);
    }
  }
  ConstraintSet candidates = mode_ | near;
  if (!event.activated.Empty()) {
    const ConstraintSet touching = mode_ | event.activated | near;
    if (!Impact(x, touching)) run->doubt = "an impact has no solution";
    const Vector after = terms.jacobian * x->tail(d);
    candidates = ConstraintSet();
    for (int i : touching) {
      if (std::abs(after(i)) > kRest) {
        if (after(i) < 0) run->doubt = "an impact leaves an approach";
        continue;
      }
      // What is left of its rate is none, unless the floor alone takes it for rest.
      const bool floored = std::abs(after(i)) > kGap;
      const bool bounces = event.activated.Contains(i) && system_.restitution()(i) > 0;
      if (floored || bounces) run->settled = true;
      candidates.Insert(i);
    }
  }
  std::string doubt;
  mode_ = Decide(x, candidates, &doubt);
  if (!doubt.empty()) run->doubt = doubt;
  event.after = mode_;
  run->events.push_back(event);
}

ReferenceRun ReferenceFlow::Run(Vector x, const InputSchedule& schedule, double duration,
                                ConstraintSet held) {
  const int d = system_.dof();
  ReferenceRun run;
  u_ = schedule.values.front();
  PutInContact(&x, held);
  system_.Constraints(x.head(d), x.tail(d), &terms_);
  if (terms_.gap.size() > 0 && terms_.gap.minCoeff() < -1e-11) run.doubt = "the start penetrates";
  mode_ = ConstraintSet();
  double t = schedule.grid.front(), h = options_.largest_step;
  const double end = t + duration;
  if (run.doubt.empty()) {
    // At rest, or an impact at once.
    mode_ = held;
    Resolve(&x, -1, t, &run);
  }
  std::size_t input = 0;
  long steps = 0, idle = 0;
  while (run.doubt.empty() && t < end) {
    const double next =
        input + 1 < schedule.grid.size() ? std::min(schedule.grid[input + 1], end) : end;
    if (next <= t && next < end) {
      u_ = schedule.values[++input];
      std::string doubt;
      mode_ = Decide(&x, mode_, &doubt);
      if (!doubt.empty()) run.doubt = doubt;
      continue;
    }
    if (++steps > options_.max_steps) run.doubt = "too many steps";
    const double length = std::min({h, Limit(x), next - t});
    Vector y;
    const double error = Step(x, length, &y);
    if (!y.allFinite() || !(error <= 10 * options_.tolerance)) {
      h = 0.5 * length;
      if (h < 1e-10 && !y.allFinite()) run.doubt = "no step is small enough";
      if (h > 1e-7 || !y.allFinite()) continue;
    }
    const Event event = FirstEvent(x, y, length, &run);
    if (event.constraint < 0) {
      x = y;
      t = length == next - t ? next : t + length;
      h = 1.5 * length;
      continue;
    }
    // On the true step: the secant method, kept in a bracket.
    double low = 0, high = length, s = event.s, before_s = 0, before_g = 0;
    bool known = false;
    Vector z = x;
    for (int k = 0; k < 30; ++k) {
      Step(x, s, &z);
      const double g = Guard(z, event.constraint);
      (g < 0 ? high : low) = s;
      double slope = known ? (g - before_g) / (s - before_s) : 0;
      if (!known && !mode_.Contains(event.constraint)) {
        slope = terms_.jacobian.row(event.constraint).dot(z.tail(d));
      } else if (!known) {
        Vector w;
        Step(x, s + 1e-6, &w);
        slope = (Guard(w, event.constraint) - g) / 1e-6;
      }
      before_s = s;
      before_g = g;
      known = true;
      if (g == 0 || slope == 0) break;
      double next_s = s - g / slope;
      if (!(next_s >= low && next_s <= high)) next_s = 0.5 * (low + high);
      if (std::abs(next_s - s) < 1e-16 + 1e-15 * length) break;
      s = next_s;
    }
    x = z;
    t += s;
    Resolve(&x, event.constraint, t, &run);
    const ReferenceEvent& last = run.events.back();
    const bool changed = !last.activated.Empty() || last.before != last.after;
    idle = changed || s > options_.no_time ? 0 : idle + 1;
    if (idle > options_.max_idle) run.doubt = "events that change nothing";
    h = options_.largest_step;
    if (static_cast<long>(run.events.size()) > options_.max_events) run.doubt = "too many events";
  }
  run.x = x;
  return run;
}

}  // namespace adversary
}  // namespace contact_flow
