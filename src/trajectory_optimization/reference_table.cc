// SPDX-License-Identifier: BSD-3-Clause
#include "reference_table.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {
namespace {

/// Between two times of a table [s]: a cubic's error is 3e-12 of motions of 10 rad/s.
constexpr double kSpacing = 1e-3;
/// Steps of the continuation between them.
constexpr int kSteps = 2;
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
  Motion(const MechanicalSystem& system, const InputSchedule& inputs, ContactMode mode)
      : system_(system), inputs_(inputs), mode_(mode), dynamics_(system, inputs.values.front()) {}

  void SetInterval(std::size_t k) { dynamics_.SetInput(inputs_.values[k]); }
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
  const InputSchedule& inputs_;
  const ContactMode mode_;
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

/// from, the instants of the grid strictly between, to; in the direction of time or against it.
std::vector<double> Breaks(const std::vector<double>& grid, double from, double to) {
  std::vector<double> breaks = {from};
  for (double t : grid) {
    if (t > std::min(from, to) && t < std::max(from, to)) breaks.push_back(t);
  }
  breaks.push_back(to);
  if (to < from) std::reverse(breaks.begin() + 1, breaks.end() - 1);
  return breaks;
}

/// Rows from `from` to `to`, each part between two changes of the input with both its ends; `next`
/// makes the state at t from that of the row before. Ends early where the motion does.
template <class Next>
std::vector<Row> RowsOfMotion(Motion* motion, const std::vector<double>& grid, double from,
                              double to, Vector x, double fastest, const Next& next) {
  std::vector<Row> rows;
  const std::vector<double> breaks = Breaks(grid, from, to);
  for (std::size_t i = 0; i + 1 < breaks.size() && from != to; ++i) {
    const double begin = breaks[i], span = breaks[i + 1] - begin;
    motion->SetInterval(IntervalAt(grid, begin + 0.5 * span));
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

void TabulatePhase(const MechanicalSystem& system, const Trajectory& run,
                   const InputSchedule& inputs, double before, double after,
                   ReferencePhase* phase) {
  Motion motion(system, inputs, phase->mode);
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
      RowsOfMotion(&motion, inputs.grid, begin, begin - before, phase->x_begin, fastest, continued);
  std::reverse(rows.begin(), rows.end());
  const std::vector<Row> inside =
      RowsOfMotion(&motion, inputs.grid, begin, end, phase->x_begin, kLargestState, of_run);
  if (inside.empty() || inside.back().t != end) {
    throw std::invalid_argument("the reference has no acceleration at " +
                                std::to_string(inside.empty() ? begin : inside.back().t) + " s");
  }
  const std::vector<Row> behind =
      RowsOfMotion(&motion, inputs.grid, end, end + after, phase->x_end, fastest, continued);
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
