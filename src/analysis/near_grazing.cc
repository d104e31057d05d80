// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/near_grazing.h"

#include <cmath>
#include <sstream>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/guards.h"
#include "guard_dips.h"

namespace contact_flow {
namespace {

using Kind = GrazingEvent::Kind;

/// What the margins say where the motion between events was not kept, or shows nothing.
void AddUnnamed(Kind kind, double margin, double threshold, std::vector<GrazingEvent>* found) {
  if (!(margin < threshold) || !found->empty()) return;
  GrazingEvent event;
  event.kind = kind;
  event.value = margin;
  event.threshold = threshold;
  found->push_back(event);
}

const char* Unit(Kind kind) {
  switch (kind) {
    case Kind::kSlowTouchdown:
      return "m/s";
    case Kind::kSlowRelease:
      return "N/s";
    case Kind::kNearTouchdown:
      return "m";
    case Kind::kNearRelease:
      return "N";
  }
  return "";
}

}  // namespace

const char* GrazingKindName(Kind kind) {
  switch (kind) {
    case Kind::kSlowTouchdown:
      return "slow touchdown";
    case Kind::kSlowRelease:
      return "slow release";
    case Kind::kNearTouchdown:
      return "near touchdown";
    case Kind::kNearRelease:
      return "near release";
  }
  return "unknown";
}

std::vector<GrazingEvent> FindNearGrazing(const MechanicalSystem& system,
                                          const Trajectory& trajectory,
                                          const GrazingThresholds& thresholds) {
  const Guards guards(system);
  std::vector<GrazingEvent> touchdowns, releases, gaps, forces;
  for (std::size_t k = 0; k < trajectory.transitions.size(); ++k) {
    AskBudget();
    const Transition& transition = trajectory.transitions[k];
    ContactDynamics dynamics(system, trajectory.arcs[k].u);
    const auto rate_of = [&](int guard) {
      return std::abs(guards.At(guard, &dynamics, transition.x_minus, transition.mode_before).rate);
    };
    for (int i : transition.activated | transition.switched) {
      const double speed = rate_of(i);
      if (speed >= thresholds.approach_speed) continue;
      touchdowns.push_back(
          {Kind::kSlowTouchdown, i, transition.t, speed, thresholds.approach_speed});
    }
    for (int i : transition.vanishing) {
      const double rate = rate_of(i);
      if (rate >= thresholds.release_rate) continue;
      releases.push_back({Kind::kSlowRelease, i, transition.t, rate, thresholds.release_rate});
    }
  }
  const Margins& margins = trajectory.margins;
  if (margins.gap < thresholds.gap || margins.force < thresholds.force) {
    for (const Arc& arc : trajectory.arcs) {
      for (const GuardDip& dip : FindGuardDips(system, arc, trajectory.gap_tolerance)) {
        const double threshold = dip.is_force ? thresholds.force : thresholds.gap;
        if (!(dip.value < threshold)) continue;
        const Kind kind = dip.is_force ? Kind::kNearRelease : Kind::kNearTouchdown;
        (dip.is_force ? forces : gaps)
            .push_back({kind, dip.constraint, dip.t, dip.value, threshold});
      }
    }
    AddUnnamed(Kind::kNearTouchdown, margins.gap, thresholds.gap, &gaps);
    AddUnnamed(Kind::kNearRelease, margins.force, thresholds.force, &forces);
  }
  for (const std::vector<GrazingEvent>* found : {&releases, &gaps, &forces}) {
    touchdowns.insert(touchdowns.end(), found->begin(), found->end());
  }
  return touchdowns;
}

std::string Describe(const SystemDescription& description, const GrazingEvent& event) {
  const std::string name =
      event.constraint < 0 ? "a constraint" : "'" + description.constraints[event.constraint] + "'";
  std::ostringstream text;
  text << "near grazing: ";
  switch (event.kind) {
    case Kind::kSlowTouchdown:
      text << name << " touches with ";
      break;
    case Kind::kSlowRelease:
      text << name << " lets go with dλ/dt of size ";
      break;
    case Kind::kNearTouchdown:
      text << "the gap of " << name << " comes to ";
      break;
    case Kind::kNearRelease:
      text << "the force of " << name << " comes to ";
      break;
  }
  text << event.value << " " << Unit(event.kind);
  if (!std::isnan(event.t)) text << " at t = " << event.t << " s";
  return text.str();
}

}  // namespace contact_flow
