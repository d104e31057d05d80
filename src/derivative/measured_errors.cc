// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/measured_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace contact_flow {
namespace {

/// Tolerances of the other run in those of the first. Errors are about proportional to them, so
/// that what differs is the error but for this part of it.
constexpr double kFiner = 1.0 / 64, kCoarser = 10;
/// … of its tangents, whose errors fall in leaps.
constexpr double kFinerTangents = 1e-3;
constexpr double kMostSteps = 8;
/// Relative tolerances below this are rounding.
constexpr double kFinest = 1e-13;
/// What SimulateOptions admits.
constexpr double kLeastTolerance = 1e-15, kLargestTolerance = 1e-2;
/// Both runs may be wrong by nearly the same in some entry. Errors are at least this many times
/// what differs, and this part of what is estimated of the first run by itself.
constexpr double kSafety = 3, kByItself = 0.002;

/// Half the longest step of the arc in which that is the shortest, so that no arc is repeated as it
/// was; but not so short that there would be more than kMostSteps times as many.
double HalfStep(const Trajectory& run) {
  double shortest = std::numeric_limits<double>::infinity(), steps = 0;
  for (const Arc& arc : run.arcs) {
    double longest = 0;
    for (std::size_t k = 0; k < arc.dense.NumSteps(); ++k) {
      longest = std::max(longest, arc.dense.StepLength(k));
    }
    if (longest > 0) shortest = std::min(shortest, longest);
    steps += static_cast<double>(arc.dense.NumSteps());
  }
  if (steps == 0) return 0;
  return std::max(shortest / 2, (run.t_end() - run.t_begin()) / (kMostSteps * steps));
}

Vector Measured(double safety, const Vector& differs, const Vector& by_itself) {
  return (safety * differs.cwiseAbs()).cwiseMax(kByItself * by_itself);
}

}  // namespace

MeasuredErrors::MeasuredErrors(const MechanicalSystem& system, const VectorRef& x,
                               const InputSchedule& input, double duration,
                               const SimulateOptions& options, const Trajectory& trajectory,
                               const BDerivative& derivative)
    : system_(system), trajectory_(trajectory), derivative_(derivative), safety_(kSafety) {
  SimulateOptions other = options;
  double factor = std::max(kFiner, kFinest / options.relative_tolerance);
  if (factor > 0.5) {
    factor = kCoarser;
  } else {
    other.max_step = HalfStep(trajectory);
  }
  for (double* tolerance : {&other.relative_tolerance, &other.absolute_tolerance}) {
    *tolerance = std::clamp(*tolerance * factor, kLeastTolerance, kLargestTolerance);
  }
  other.dense = true;
  other_trajectory_ = Simulate(system, x, input, duration, other);
  BDerivativeOptions tangents = derivative.options;
  tangents.tolerance = std::max(kFinerTangents * tangents.tolerance, kFinest);
  other_derivative_ = DifferentiateOutcome(system, other_trajectory_, tangents);
  const Status& failed = other_derivative_.status;  // also that of the run
  const bool same = other_trajectory_.ModeSequence() == trajectory.ModeSequence();
  if (failed.ok() && same) return;
  std::ostringstream message;
  message << "the same run at " << (factor < 1 ? "smaller" : "larger") << " tolerances ("
          << other.relative_tolerance << ") ";
  if (failed.ok()) {
    message << "passes other contact modes: errors are what this changes";
  } else {
    message << "has no derivative: " << failed.message;
  }
  status_ = {failed.ok() ? Outcome::kNotDifferentiable : failed.outcome, message.str()};
}

Vector MeasuredErrors::OfState() const {
  const Vector& by_itself = derivative_.trust.state_error;
  if (!other_trajectory_.status.ok()) return by_itself;
  return Measured(safety_,
                  system_.Separation(other_trajectory_.FinalState(), trajectory_.FinalState()),
                  by_itself);
}

Vector MeasuredErrors::Along(const VectorRef& w) const {
  const Vector by_itself = derivative_.Error(w);
  if (!other_derivative_.status.ok()) return by_itself;
  try {
    return Measured(safety_, other_derivative_(w) - derivative_(w), by_itself);
  } catch (const std::logic_error&) {  // a direction that the other derivative refuses
    return by_itself;
  }
}

}  // namespace contact_flow
