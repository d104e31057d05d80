// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/extended_reference.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "reference_table.h"

namespace contact_flow {
namespace {

/// The phases of a run, without tables; what comes by the time ends none.
std::vector<ReferencePhase> PhasesOf(const Trajectory& run, ConstraintSet instants) {
  std::vector<ReferencePhase> phases;
  ReferencePhase phase;
  const auto begin = [&phase](const Arc& arc) {
    phase = ReferencePhase();
    phase.mode = arc.mode;
    phase.t_begin = arc.t_begin;
    phase.x_begin = arc.x_begin;
  };
  begin(run.arcs.front());
  for (std::size_t k = 0; k < run.arcs.size(); ++k) {
    phase.t_end = run.arcs[k].t_end;
    phase.x_end = run.arcs[k].x_end;
    if (k == run.transitions.size()) break;
    const Transition& event = run.transitions[k];
    const ContactMode before = event.mode_before.Without(instants);
    phase.activated = (event.activated | event.switched) - instants;
    phase.released = event.released - instants;
    const bool same = event.mode_after.Without(instants) == before;
    const bool only_instants =
        !(event.switched & instants).Empty() && (phase.activated | phase.released).Empty();
    if (same && (event.changes_input || only_instants)) continue;
    phases.push_back(phase);
    begin(run.arcs[k + 1]);
  }
  phases.push_back(phase);
  return phases;
}

/// The cubic with these values and slopes at the ends of an interval of length h, at the share s.
double Cubic(double a, double da, double b, double db, double h, double s) {
  const double rise = b - a, first = h * da, last = h * db;
  return a + s * (first + s * (3 * rise - 2 * first - last + s * (first + last - 2 * rise)));
}

}  // namespace

ExtendedReference::ExtendedReference(const MechanicalSystem& system, const Trajectory& run,
                                     InputSchedule inputs, double reach)
    : space_(system.space()), inputs_(std::move(inputs)) {
  if (!run.status.ok()) {
    throw std::invalid_argument("the reference ended early: " + run.status.message);
  }
  if (!(reach >= 0) || !std::isfinite(reach)) {
    throw std::invalid_argument("the reach of a reference must be finite and ≥ 0");
  }
  Validate(system, inputs_);
  const ReferenceTime time(system, run, inputs_);
  instants_ = time.instants();
  phases_ = PhasesOf(run, instants_);
  for (std::size_t k = 0; k < phases_.size(); ++k) {
    TabulatePhase(system, run, time, k > 0 ? reach : 0, reach, &phases_[k]);
  }
}

ExtendedReference::ExtendedReference(ConfigurationSpace space, InputSchedule inputs,
                                     std::vector<ReferencePhase> phases, ConstraintSet instants)
    : space_(std::move(space)),
      inputs_(std::move(inputs)),
      phases_(std::move(phases)),
      instants_(instants) {}

int ExtendedReference::PhaseAt(double t) const {
  int phase = 0;
  while (phase + 1 < static_cast<int>(phases_.size()) &&
         t > phases_[static_cast<std::size_t>(phase)].t_end) {
    ++phase;
  }
  return phase;
}

const Vector& ExtendedReference::Input(double t) const {
  return inputs_.values[IntervalAt(inputs_.grid, t)];
}

Vector ExtendedReference::State(int number, double t) const {
  const ReferencePhase& phase = phases_.at(static_cast<std::size_t>(number));
  const auto behind = std::upper_bound(phase.t.begin(), phase.t.end(), t);
  if (behind == phase.t.begin()) return phase.x.col(0);
  const auto k = static_cast<Eigen::Index>(behind - phase.t.begin()) - 1;
  const double begin = phase.t[static_cast<std::size_t>(k)];
  if (t == begin || behind == phase.t.end()) return phase.x.col(k);
  const double h = *behind - begin, s = (t - begin) / h;
  const int nq = space_.num_positions(), d = space_.dof();
  const Vector from = phase.x.col(k), to = phase.x.col(k + 1);
  Vector from_rate(nq + d), to_rate(nq + d), x(nq + d);
  space_.Rate(from.data(), from.data() + nq, from_rate.data());
  space_.Rate(to.data(), to.data() + nq, to_rate.data());
  from_rate.tail(d) = phase.a.col(k);
  to_rate.tail(d) = phase.a.col(k + 1);
  for (int i = 0; i < nq + d; ++i) x(i) = Cubic(from(i), from_rate(i), to(i), to_rate(i), h, s);
  space_.Normalize(x.data());
  return x;
}

Vector ExtendedReference::Error(int phase, double t, const VectorRef& x) const {
  const int nq = space_.num_positions(), d = space_.dof();
  const Vector reference = State(phase, t);
  Vector error(2 * d);
  error.head(d) = space_.Difference(x.head(nq), reference.head(nq));
  error.tail(d) = x.tail(d) - reference.tail(d);
  return error;
}

}  // namespace contact_flow
