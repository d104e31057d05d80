// SPDX-License-Identifier: BSD-3-Clause
#include "reference_table.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

/// Between two times of a table [s]: a cubic's error is 3e-12 of motions of 10 rad/s.
constexpr double kSpacing = 1e-3;
/// Steps of the continuation between them.
constexpr int kSteps = 2;
/// A rate is steady, and instants are the same, to rounding.
constexpr double kSteady = 1e-9, kSameInstant = 1e-12;
/// What a row takes for each number of its state, here, in the phase and in a message.
constexpr double kRowBytes = 64;
/// Larger numbers are not written: no file and no message may hold them.
constexpr double kLargestState = 1e100;

/// The continuation ends where it is this many times as fast as the run ever is: what is damped
/// grows when time goes back.
constexpr double kGrowth = 3;

/// One row of a table.
struct Row {
  double t;
  Vector x, a;
};

/// The motion of one phase.
class Motion {
 public:
  Motion(const MechanicalSystem& system, const ReferenceTime& time, ContactMode mode)
      : system_(system), time_(time), mode_(mode), dynamics_(system, time.Input(0)) {}

  /// What holds at t, between two changes.
  void SetTime(double t) {
    dynamics_.SetInput(time_.Input(t));
    mode_ = time_.Mode(mode_, t);
  }
  Vector Acceleration(const Vector& x) {
    dynamics_.Evaluate(x, mode_);
    return dynamics_.acceleration();
  }
  /// By the method of Runge and Kutta.
  Vector Step(const Vector& x, double h) {
    const Vector k1 = Rate(x), k2 = Rate(x + 0.5 * h * k1), k3 = Rate(x + 0.5 * h * k2);
    Vector next = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + Rate(x + h * k3));
    system_.space().Normalize(next.data());
    return next;
  }

 private:
  Vector Rate(const Vector& x) {
    const int nq = system_.num_positions();
    Vector rate(x.size());
    system_.space().Rate(x.data(), x.data() + nq, rate.data());
    rate.tail(system_.dof()) = Acceleration(x);
    return rate;
  }

  const MechanicalSystem& system_;
  const ReferenceTime& time_;
  ContactMode mode_;
  ContactDynamics dynamics_;
};

/// Whether a row may be written and read again, and is of a motion that is worth following.
bool Sound(const Row& row, double fastest) {
  if (row.x.tail(row.a.size()).norm() > kGrowth * fastest) return false;
  const auto sound = [](const Vector& numbers) {
    return numbers.allFinite() &&
           (numbers.size() == 0 || numbers.cwiseAbs().maxCoeff() <= kLargestState);
  };
  return sound(row.x) && sound(row.a);
}

/// from, the changes strictly between, to; in the direction of time or against it.
std::vector<double> Breaks(const std::vector<double>& changes, double from, double to) {
  std::vector<double> breaks = {from};
  for (double t : changes) {
    if (t > std::min(from, to) && t < std::max(from, to)) breaks.push_back(t);
  }
  breaks.push_back(to);
  if (to < from) std::reverse(breaks.begin() + 1, breaks.end() - 1);
  return breaks;
}

/// Rows from `from` to `to`, each part between two changes with both its ends; `next`
/// makes the state at t from that of the row before. Ends early where the motion does.
template <class Next>
std::vector<Row> RowsOfMotion(Motion* motion, const std::vector<double>& changes, double from,
                              double to, Vector x, double fastest, const Next& next) {
  std::vector<Row> rows;
  const std::vector<double> breaks = Breaks(changes, from, to);
  for (std::size_t i = 0; i + 1 < breaks.size() && from != to; ++i) {
    const double begin = breaks[i], span = breaks[i + 1] - begin;
    motion->SetTime(begin + 0.5 * span);
    const double parts = std::max(1.0, std::ceil(std::abs(span) / kSpacing));
    AskMemory(parts * kRowBytes * static_cast<double>(x.size()), "the table of a reference");
    const long count = static_cast<long>(std::min(parts, 1e15));
    for (long j = 0; j <= count; ++j) {
      AskBudget();  // outside of what a motion that ends throws
      const auto part = static_cast<double>(j);
      const double t = j == count ? breaks[i + 1] : begin + span * part / parts;
      try {
        if (j > 0) x = next(t, rows.back());
        rows.push_back({t, x, motion->Acceleration(x)});
      } catch (const std::exception&) {  // a mode has no motion everywhere
        return rows;
      }
      if (Sound(rows.back(), fastest)) continue;
      rows.pop_back();
      return rows;
    }
  }
  return rows;
}

}  // namespace

std::size_t IntervalAt(const std::vector<double>& grid, double t) {
  const auto next = std::upper_bound(grid.begin(), grid.end(), t);
  return next == grid.begin() ? 0 : static_cast<std::size_t>(next - grid.begin()) - 1;
}

ReferenceTime::ReferenceTime(const MechanicalSystem& system, const Trajectory& run,
                             const InputSchedule& inputs)
    : inputs_(inputs), changes_(inputs.grid) {
  const int nq = system.num_positions(), d = system.dof();
  const Vector &first = run.arcs.front().x_begin, &last = run.arcs.back().x_end;
  instants_ = DrivenSwitches(system, first.head(nq), first.tail(d)) &
              DrivenSwitches(system, last.head(nq), last.tail(d));
  if (instants_.Empty()) return;
  ConstraintTerms begin, end;
  system.Constraints(first.head(nq), first.tail(d), &begin);
  system.Constraints(last.head(nq), last.tail(d), &end);
  const double duration = run.t_end() - run.t_begin();
  for (int i : instants_) {
    const double rate = begin.jacobian.row(i).dot(first.tail(d)), gap = begin.gap(i);
    const double t = run.t_begin() - gap / rate;
    const double off = std::abs(gap + rate * duration - end.gap(i));
    if (!(rate < 0) || off > kSteady * (std::abs(gap) + std::abs(end.gap(i)))) {
      instants_.Erase(i);
      continue;
    }
    when_.emplace_back(i, t);
    const bool known = std::any_of(changes_.begin(), changes_.end(), [t](double other) {
      return std::abs(other - t) <= kSameInstant * std::max(1.0, std::abs(t));
    });
    if (!known) changes_.push_back(t);
  }
  std::sort(changes_.begin(), changes_.end());
}

ContactMode ReferenceTime::Mode(ContactMode mode, double t) const {
  for (const auto& [i, when] : when_) {
    if (t <= when) mode = mode.Without(i);
    if (t > when && !mode.Contains(i)) mode = mode.With(i);
  }
  return mode;
}

void TabulatePhase(const MechanicalSystem& system, const Trajectory& run, const ReferenceTime& time,
                   double before, double after, ReferencePhase* phase) {
  Motion motion(system, time, phase->mode);
  const std::vector<double>& changes = time.changes();
  const double begin = phase->t_begin, end = phase->t_end;
  const auto continued = [&motion](double t, const Row& last) {
    const double h = (t - last.t) / kSteps;
    Vector x = last.x;
    for (int i = 0; i < kSteps; ++i) x = motion.Step(x, h);
    return x;
  };
  const auto of_run = [&](double t, const Row&) { return t == end ? phase->x_end : run.State(t); };
  double fastest = 0;
  for (const Arc& arc : run.arcs) {
    fastest = std::max(
        {fastest, arc.x_begin.tail(system.dof()).norm(), arc.x_end.tail(system.dof()).norm()});
  }
  std::vector<Row> rows =
      RowsOfMotion(&motion, changes, begin, begin - before, phase->x_begin, fastest, continued);
  std::reverse(rows.begin(), rows.end());
  const std::vector<Row> inside =
      RowsOfMotion(&motion, changes, begin, end, phase->x_begin, kLargestState, of_run);
  if (inside.empty() || inside.back().t != end) {
    throw std::invalid_argument("the reference has no acceleration at " +
                                std::to_string(inside.empty() ? begin : inside.back().t) + " s");
  }
  const std::vector<Row> behind =
      RowsOfMotion(&motion, changes, end, end + after, phase->x_end, fastest, continued);
  rows.insert(rows.end(), inside.begin(), inside.end());
  rows.insert(rows.end(), behind.begin(), behind.end());
  const auto count = static_cast<Eigen::Index>(rows.size());
  phase->x.resize(system.state_size(), count);
  phase->a.resize(system.dof(), count);
  for (const Row& row : rows) {
    const auto k = static_cast<Eigen::Index>(phase->t.size());
    phase->t.push_back(row.t);
    phase->x.col(k) = row.x;
    phase->a.col(k) = row.a;
  }
}

}  // namespace contact_flow
