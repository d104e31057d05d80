// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/trajectory.h"

#include <sstream>
#include <stdexcept>

namespace contact_flow {

const char* OutcomeName(Outcome outcome) {
  switch (outcome) {
    case Outcome::kOk:
      return "ok";
    case Outcome::kGrazing:
      return "grazing";
    case Outcome::kZeno:
      return "zeno";
    case Outcome::kBudgetExceeded:
      return "budget exceeded";
    case Outcome::kNonFinite:
      return "non-finite";
    case Outcome::kCancelled:
      return "cancelled";
    case Outcome::kDiscontinuous:
      return "discontinuous";
    case Outcome::kNotDifferentiable:
      return "not differentiable";
    case Outcome::kTooManyPieces:
      return "too many pieces";
    case Outcome::kFilippov:
      return "sliding or not unique (Filippov)";
    case Outcome::kPainleveInconsistent:
      return "no contact forces (Painleve)";
    case Outcome::kPainleveIndeterminate:
      return "several motions (Painleve)";
    case Outcome::kPainleveCrossing:
      return "singular slip (Painleve)";
    case Outcome::kIndeterminateForces:
      return "indeterminate forces";
    case Outcome::kNoConsistentImpact:
      return "no consistent impact";
    case Outcome::kAmbiguousImpact:
      return "ambiguous impact";
    case Outcome::kEnergyGain:
      return "energy gain";
    case Outcome::kNotPiecewiseLinear:
      return "not piecewise linear";
    case Outcome::kChatter:
      return "chatter";
  }
  return "unknown";
}

std::vector<ContactMode> Trajectory::ModeSequence() const {
  std::vector<ContactMode> modes;
  for (const Arc& arc : arcs) modes.push_back(arc.mode);
  return modes;
}

int Trajectory::ArcAt(double t) const {
  if (!(t >= t_begin() && t <= t_end())) {
    std::ostringstream message;
    message << "t = " << t << " s lies outside the trajectory [" << t_begin() << ", " << t_end()
            << "] s";
    throw std::out_of_range(message.str());
  }
  int k = 0;
  while (t > arcs[k].t_end) ++k;
  return k;
}

Vector Trajectory::State(double t) const {
  const Arc& arc = arcs[ArcAt(t)];
  if (t == arc.t_end) return arc.x_end;
  if (t == arc.t_begin) return arc.x_begin;
  if (arc.dense.Empty()) {
    throw std::logic_error("the trajectory was made without SimulateOptions::dense");
  }
  Vector x(arc.x_begin.size());
  arc.dense.Evaluate(t, x.data());
  return x;
}

}  // namespace contact_flow
