// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

#include "contact_flow/nearest_name.h"
#include "contact_flow/trajectory_optimization/policy.h"

namespace contact_flow {
namespace {

/// Larger numbers are taken from nobody, so none is given.
constexpr double kLargest = 1e100;
constexpr double kNoBoundOfInput = std::numeric_limits<double>::infinity();
/// Of quaternions: rounding of a cubic between two of them is far less.
constexpr double kNormTolerance = 1e-6;

std::string At(const std::string& field, std::size_t k) {
  return field + "[" + std::to_string(k) + "]";
}

template <class Value>
[[noreturn]] void Fail(const std::string& field, const Value& value, const std::string& expected) {
  std::ostringstream message;
  message.precision(17);
  message << field << " is " << value << ", expected " << expected;
  throw std::invalid_argument(message.str());
}

void RequireCount(const std::string& field, std::size_t actual, std::size_t expected) {
  if (actual == expected) return;
  throw std::invalid_argument(field + " has " + std::to_string(actual) + " entries, expected " +
                              std::to_string(expected));
}

void RequireNumber(const std::string& field, double number) {
  if (!(std::abs(number) <= kLargest)) Fail(field, number, "a finite number, up to 1e100 in size");
}

void RequireSize(const std::string& field, const MatrixRef& numbers, Eigen::Index rows,
                 Eigen::Index cols) {
  if (numbers.rows() == rows && numbers.cols() == cols) return;
  throw std::invalid_argument(field + " is " + std::to_string(numbers.rows()) + " × " +
                              std::to_string(numbers.cols()) + ", expected " +
                              std::to_string(rows) + " × " + std::to_string(cols));
}

/// [size] numbers.
void RequireVector(const std::string& field, const VectorRef& numbers, Eigen::Index size) {
  RequireCount(field, static_cast<std::size_t>(numbers.size()), static_cast<std::size_t>(size));
  for (Eigen::Index i = 0; i < size; ++i) {
    RequireNumber(At(field, static_cast<std::size_t>(i)), numbers(i));
  }
}

/// [size] numbers, or `none` where there is no bound.
void RequireBounds(const std::string& field, const Vector& bounds, double none, Eigen::Index size) {
  RequireVector(field, (bounds.array() == none).select(0, bounds), size);
}

void RequireNames(const std::string& field, const std::vector<std::string>& names,
                  Eigen::Index size) {
  RequireCount(field, names.size(), static_cast<std::size_t>(size));
  std::set<std::string> seen;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (names[k].empty() || !seen.insert(names[k]).second) {
      Fail(At(field, k), QuoteName(names[k]), "a name of its own");
    }
  }
}

void CheckInputs(const InputSchedule& inputs, Eigen::Index m) {
  if (inputs.grid.empty()) throw std::invalid_argument("grid is empty, expected an instant");
  RequireCount("feed_forward", inputs.values.size(), inputs.grid.size());
  for (std::size_t k = 0; k < inputs.grid.size(); ++k) {
    RequireNumber(At("grid", k), inputs.grid[k]);
    if (k > 0 && !(inputs.grid[k] > inputs.grid[k - 1])) {
      Fail(At("grid", k), inputs.grid[k], "a later instant than the one before");
    }
    RequireVector(At("feed_forward", k), inputs.values[k], m);
  }
}

void CheckTable(const std::string& field, const ReferencePhase& phase,
                const ConfigurationSpace& space) {
  const auto count = static_cast<Eigen::Index>(phase.t.size());
  if (count < 2) {
    throw std::invalid_argument(field + ".times has " + std::to_string(count) +
                                " entries, expected two or more");
  }
  for (std::size_t k = 0; k < phase.t.size(); ++k) {
    RequireNumber(At(field + ".times", k), phase.t[k]);
    if (k > 0 && !(phase.t[k] >= phase.t[k - 1])) {
      Fail(At(field + ".times", k), phase.t[k], "no earlier time than the one before");
    }
  }
  if (!(phase.t.front() <= phase.t_begin)) {
    Fail(field + ".times[0]", phase.t.front(), "t_begin or earlier");
  }
  if (!(phase.t.back() >= phase.t_end)) {
    Fail(At(field + ".times", phase.t.size() - 1), phase.t.back(), "t_end or later");
  }
  RequireSize(field + ".states", phase.x, space.num_positions() + space.dof(), count);
  RequireSize(field + ".accelerations", phase.a, space.dof(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto row = static_cast<std::size_t>(k);
    RequireVector(At(field + ".states", row), phase.x.col(k), phase.x.rows());
    RequireVector(At(field + ".accelerations", row), phase.a.col(k), phase.a.rows());
    const double error = space.NormError(phase.x.col(k).head(space.num_positions()));
    if (!(error <= kNormTolerance)) {
      Fail("the norm of a quaternion in " + At(field + ".states", row), 1 + error, "1");
    }
  }
}

/// Whether the table has this state at t, first or last of what it has there.
void RequireRow(const std::string& field, const ReferencePhase& phase, double t, const Vector& x) {
  const auto range = std::equal_range(phase.t.begin(), phase.t.end(), t);
  const auto first = static_cast<Eigen::Index>(range.first - phase.t.begin());
  const auto last = static_cast<Eigen::Index>(range.second - phase.t.begin()) - 1;
  if (first <= last && phase.x.col(first) == x && phase.x.col(last) == x) return;
  Fail(field, "not the state of the table at " + std::to_string(t) + " s", "that state");
}

void CheckPhases(const TrackingPolicy& policy) {
  const std::vector<ReferencePhase>& phases = policy.reference.phases();
  const ConfigurationSpace& space = policy.reference.space();
  if (phases.empty()) throw std::invalid_argument("phases is empty, expected one or more");
  const ConstraintSet all = ConstraintSet::All(static_cast<int>(policy.names.constraints.size()));
  if (!(policy.reference.instants() - all).Empty()) {
    throw std::invalid_argument("instants has some that constraints does not name");
  }
  for (std::size_t k = 0; k < phases.size(); ++k) {
    const ReferencePhase& phase = phases[k];
    const std::string field = At("phases", k);
    RequireNumber(field + ".t_begin", phase.t_begin);
    RequireNumber(field + ".t_end", phase.t_end);
    if (!(phase.t_end > phase.t_begin)) Fail(field + ".t_end", phase.t_end, "more than t_begin");
    if (k > 0 && phase.t_begin != phases[k - 1].t_end) {
      Fail(field + ".t_begin", phase.t_begin, "t_end of the phase before");
    }
    const Eigen::Index size = space.num_positions() + space.dof();
    RequireVector(field + ".x_begin", phase.x_begin, size);
    RequireVector(field + ".x_end", phase.x_end, size);
    if (!((phase.mode | phase.activated | phase.released) - all).Empty()) {
      throw std::invalid_argument(field + " has contacts that constraints does not name");
    }
    if (!((phase.activated | phase.released) & policy.reference.instants()).Empty()) {
      throw std::invalid_argument(field + " ends with one of instants, which end no phase");
    }
    CheckTable(field, phase, space);
    RequireRow(field + ".x_begin", phase, phase.t_begin, phase.x_begin);
    RequireRow(field + ".x_end", phase, phase.t_end, phase.x_end);
  }
}

void CheckGains(const TrackingPolicy& policy, Eigen::Index m) {
  const std::size_t count = policy.gains.size();
  if (count == 0 || count > policy.reference.inputs().grid.size()) {
    Fail("the number of gains", count,
         "1 to " + std::to_string(policy.reference.inputs().grid.size()) + ", one an interval");
  }
  RequireCount("gain_phases", policy.gain_phases.size(), count);
  for (std::size_t k = 0; k < count; ++k) {
    const Matrix& gain = policy.gains[k];
    RequireSize(At("gains", k), gain, m, 2 * policy.reference.space().dof());
    for (Eigen::Index i = 0; i < gain.rows(); ++i) {
      for (Eigen::Index j = 0; j < gain.cols(); ++j) {
        RequireNumber(At("gains", k) + "(" + std::to_string(i) + ", " + std::to_string(j) + ")",
                      gain(i, j));
      }
    }
    const int phase = policy.gain_phases[k], least = k > 0 ? policy.gain_phases[k - 1] : 0;
    const auto last = static_cast<int>(policy.reference.phases().size()) - 1;
    if (phase < least || phase > last) {
      Fail(At("gain_phases", k), phase,
           std::to_string(least) + " to " + std::to_string(last) + ", in the order of time");
    }
  }
  for (std::size_t k = 0; k < policy.kinked.size(); ++k) {
    const int least = k > 0 ? policy.kinked[k - 1] + 1 : 0;
    if (policy.kinked[k] < least || policy.kinked[k] >= static_cast<int>(count)) {
      Fail(At("kinked", k), policy.kinked[k], "an interval, in their order");
    }
  }
}

}  // namespace

void CheckPolicy(const TrackingPolicy& policy) {
  const PolicyNames& names = policy.names;
  const ConfigurationSpace& space = policy.reference.space();
  RequireNames("coordinates", names.coordinates, space.num_positions());
  RequireCount("units", names.units.size(), names.coordinates.size());
  RequireNames("velocities", names.velocities, space.dof());
  const auto n = static_cast<Eigen::Index>(names.constraints.size());
  const auto m = static_cast<Eigen::Index>(names.inputs.size());
  RequireNames("constraints", names.constraints, n);
  if (n > ConstraintSet::kMaxConstraints) {
    Fail("the number of constraints", n,
         std::to_string(ConstraintSet::kMaxConstraints) + " at most");
  }
  if (m == 0) throw std::invalid_argument("inputs is empty: there is nothing to steer with");
  RequireNames("inputs", names.inputs, m);
  CheckInputs(policy.reference.inputs(), m);
  CheckPhases(policy);
  CheckGains(policy, m);
  if (policy.lower.size() > 0) RequireBounds("lower", policy.lower, -kNoBoundOfInput, m);
  if (policy.upper.size() > 0) RequireBounds("upper", policy.upper, kNoBoundOfInput, m);
  for (Eigen::Index i = 0; i < std::min(policy.lower.size(), policy.upper.size()); ++i) {
    if (policy.lower(i) <= policy.upper(i)) continue;
    Fail(At("lower", static_cast<std::size_t>(i)), policy.lower(i), "no more than upper");
  }
}

}  // namespace contact_flow
