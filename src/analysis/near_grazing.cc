// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/near_grazing.h"

#include <cmath>
#include <sstream>

#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {
namespace {

using Kind = GrazingEvent::Kind;

constexpr int kPieces = 8;       // of one step, each with at most one turn of a guard
constexpr int kBisections = 60;  // of one piece: down to rounding

/// A gap a_i or a force λ_i along one arc, with its rate.
class Guard {
 public:
  Guard(const MechanicalSystem& system, const Arc& arc, int i)
      : system_(system),
        arc_(arc),
        i_(i),
        sign_((arc.mode & system.compliant()).Contains(i) ? -1 : 1),
        is_force_((arc.mode - system.compliant()).Contains(i)),
        dynamics_(system, arc.u),
        x_(arc.x_begin) {}

  bool is_force() const { return is_force_; }
  double Value(double t) {
    arc_.dense.Evaluate(t, x_.data());
    if (is_force_) {
      dynamics_.Evaluate(x_, arc_.mode);
      return dynamics_.force()(i_);
    }
    system_.Constraints(x_.head(system_.num_positions()), x_.tail(system_.dof()), &terms_);
    return sign_ * terms_.gap(i_);
  }
  double Rate(double t) {
    arc_.dense.Evaluate(t, x_.data());
    if (is_force_) return dynamics_.ForceRate(x_, arc_.mode, i_);
    const Vector v = x_.tail(system_.dof());
    system_.Constraints(x_.head(system_.num_positions()), v, &terms_);
    return sign_ * terms_.jacobian.row(i_).dot(v);
  }
  /// Where the rate changes from negative to positive within (left, right).
  double Turn(double left, double right) {
    for (int k = 0; k < kBisections; ++k) {
      const double middle = left + (right - left) / 2;
      (Rate(middle) < 0 ? left : right) = middle;
    }
    return right;
  }

 private:
  const MechanicalSystem& system_;
  const Arc& arc_;
  const int i_;
  const double sign_;
  const bool is_force_;
  ContactDynamics dynamics_;
  ConstraintTerms terms_;
  Vector x_;
};

/// Adds the dips of constraint i in one arc that come below the threshold.
void FindDips(const MechanicalSystem& system, const Arc& arc, int i,
              const GrazingThresholds& thresholds, std::vector<GrazingEvent>* gaps,
              std::vector<GrazingEvent>* forces) {
  Guard guard(system, arc, i);
  const double threshold = guard.is_force() ? thresholds.force : thresholds.gap;
  for (std::size_t step = 0; step < arc.dense.NumSteps(); ++step) {
    const double begin = arc.dense.StepBegin(step);
    const double end = std::min(begin + arc.dense.StepLength(step), arc.t_end);
    double left = begin, rate_left = guard.Rate(begin);
    for (int piece = 1; piece <= kPieces; ++piece) {
      const double right = begin + (end - begin) * piece / kPieces;
      const double rate_right = guard.Rate(right);
      if (rate_left < 0 && rate_right >= 0) {
        const double t = guard.Turn(left, right), value = guard.Value(t);
        if (value < threshold) {
          const Kind kind = guard.is_force() ? Kind::kNearRelease : Kind::kNearTouchdown;
          (guard.is_force() ? forces : gaps)->push_back({kind, i, t, value, threshold});
        }
      }
      left = right;
      rate_left = rate_right;
    }
  }
}

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
  const int d = system.dof(), nq = system.num_positions();
  std::vector<GrazingEvent> touchdowns, releases, gaps, forces;
  for (std::size_t k = 0; k < trajectory.transitions.size(); ++k) {
    const Transition& transition = trajectory.transitions[k];
    const Vector v = transition.x_minus.tail(d);
    ConstraintTerms terms;
    system.Constraints(transition.x_minus.head(nq), v, &terms);
    for (int i : transition.activated | transition.switched) {
      const double speed = std::abs(terms.jacobian.row(i).dot(v));
      if (speed >= thresholds.approach_speed) continue;
      touchdowns.push_back(
          {Kind::kSlowTouchdown, i, transition.t, speed, thresholds.approach_speed});
    }
    ContactDynamics dynamics(system, trajectory.arcs[k].u);
    for (int i : transition.vanishing) {
      const double rate =
          std::abs(dynamics.ForceRate(transition.x_minus, transition.mode_before, i));
      if (rate >= thresholds.release_rate) continue;
      releases.push_back({Kind::kSlowRelease, i, transition.t, rate, thresholds.release_rate});
    }
  }
  const Margins& margins = trajectory.margins;
  if (margins.gap < thresholds.gap || margins.force < thresholds.force) {
    for (const Arc& arc : trajectory.arcs) {
      for (int i = 0; i < system.num_constraints(); ++i) {
        FindDips(system, arc, i, thresholds, &gaps, &forces);
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
