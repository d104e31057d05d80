// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/trial.h"

#include "contact_flow/flow/simulate.h"

namespace contact_flow {
namespace adversary {
namespace {

ReferenceOptions OptionsOf(const Case& c, Trial::Steps steps) {
  ReferenceOptions options;
  options.law = c.options.impact_law;
  if (steps == Trial::kFine) {
    options.largest_step *= 0.37;
    options.feature *= 0.5;
  }
  return options;
}

}  // namespace

Vector Trial::Given(const Vector& w) const {
  const int d = c_.system->dof();
  Vector given = w;
  given.head(2 * d) = c_.units.State(w.head(2 * d));
  return given;
}

ConstraintSet Trial::InitialMode(std::string* doubt) const {
  return ReferenceFlow(*c_.system, OptionsOf(c_, kUsual))
      .InitialMode(c_.x, c_.schedule.values.front(), doubt);
}

ReferenceRun Trial::Reference(const Vector& w, ConstraintSet kept, Steps steps) const {
  const int d = c_.system->dof(), m = c_.system->num_inputs();
  InputSchedule schedule = c_.schedule;
  for (Vector& u : schedule.values) u += w.segment(2 * d, m);
  const Vector p = w.tail(2), x = c_.x + w.head(2 * d);
  const ReferenceOptions options = OptionsOf(c_, steps);
  if (p.isZero(0)) return ReferenceFlow(*c_.system, options).Run(x, schedule, c_.duration, kept);
  const RandomSystem other(c_.system->coefficients(), 1 + p(0), p(1));
  return ReferenceFlow(other, options).Run(x, schedule, c_.duration, kept);
}

Trajectory Trial::Simulated(double max_step) const {
  SimulateOptions options = c_.options;
  options.max_step = max_step;
  options.max_seconds = 20;
  options = c_.units.Scale(options);
  InputSchedule schedule = c_.schedule;
  for (double& t : schedule.grid) t *= c_.units.time;
  return Simulate(given_, c_.units.State(c_.x), schedule, c_.duration * c_.units.time, options);
}

bool Trial::ReferenceMerges(const Trajectory& run) const {
  const int d = given_.dof();
  ConstraintTerms terms;
  for (std::size_t k = 1; k < run.transitions.size(); ++k) {
    const Vector& x = run.transitions[k - 1].x_minus;
    given_.Constraints(x.head(d), x.tail(d), &terms);
    for (int i = 0; i < given_.num_constraints(); ++i) {
      const int place = c_.units.constraint[i];
      if (!run.transitions[k].activated.Contains(place)) continue;
      const double gap = terms.gap(place) / c_.units.gap(i);
      if (gap > 0 && gap <= 2 * ReferenceFlow::kGap) return true;
    }
  }
  return false;
}

}  // namespace adversary
}  // namespace contact_flow
