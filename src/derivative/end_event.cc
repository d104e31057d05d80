// SPDX-License-Identifier: BSD-3-Clause
#include "end_event.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

namespace contact_flow {
namespace {

/// Rounding of instants, of gaps beside the coordinates, and of rates beside their terms.
constexpr double kTimeRounding = 1e-15, kGapRounding = 1e-15, kRateRounding = 1e-12;

Status Jumps(const std::string& name, double t, double apart, double error) {
  std::ostringstream message;
  message.precision(12);
  message << "constraint '" << name << "' is hit at t = " << t
          << " s, and the run ends there as far as it is known (" << apart << " s apart, error "
          << error << " s): in runs that meet it earlier or later the outcome differs by its jump";
  return {Outcome::kDiscontinuous, message.str()};
}

}  // namespace

Status CheckEnd(const MechanicalSystem& system, const Trajectory& run, const Vector& state_error) {
  if (!state_error.allFinite()) return {};
  const auto& names = system.description().constraints;
  const int d = system.dof(), nq = system.num_positions();
  const double end = run.t_end();
  const double rounding = kTimeRounding * std::max(std::abs(end), end - run.t_begin());
  const Vector error_q = kInstantErrors * state_error.head(d);
  const Vector error_v = kInstantErrors * state_error.segment(d, d);
  for (const Transition& passed : run.transitions) {
    const ConstraintSet hit = passed.activated - system.compliant();
    const Vector jump = (passed.x_plus - passed.x_minus).tail(d).cwiseAbs();
    if (hit.Empty() || (jump.array() <= error_v.array()).all()) continue;
    double error = rounding;
    for (const EventInstant& instant : passed.instants) {
      if (hit.Contains(instant.constraint)) error = std::max(error, kInstantErrors * instant.error);
    }
    if (end - passed.t <= error) return Jumps(names[*hit.begin()], passed.t, end - passed.t, error);
  }
  const Arc& last = run.arcs.back();
  ConstraintTerms terms;
  system.Constraints(last.x_end.head(nq), last.x_end.tail(d), &terms);
  const double far = last.x_end.head(nq).cwiseAbs().maxCoeff();
  const Vector speeds = last.x_end.tail(d).cwiseAbs();
  for (int i = 0; i < system.num_constraints(); ++i) {
    if (last.mode.Contains(i) || system.compliant().Contains(i)) continue;
    const auto size = terms.jacobian.row(i).cwiseAbs();
    const double rate = terms.jacobian.row(i).dot(last.x_end.tail(d));
    const double known =
        std::max({run.speed_tolerance, size.dot(error_v), kRateRounding * size.dot(speeds)});
    if (rate >= -known) continue;
    const double error = (size.dot(error_q) + kGapRounding * size.maxCoeff() * far) / -rate;
    const double apart = terms.gap(i) / -rate;
    if (apart <= error + rounding) return Jumps(names[i], end + apart, apart, error + rounding);
  }
  return {};
}

}  // namespace contact_flow
