// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <initializer_list>
#include <limits>

#include "contact_flow/flow/simulate.h"

/// What tests of many folders say in one word.
namespace contact_flow {
namespace test {

/// Of the models and systems that tests compare with closed forms [m/s²].
inline constexpr double kGravity = 9.81;
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline constexpr ImpactLaw kImpactLaws[] = {ImpactLaw::kComplementarity, ImpactLaw::kProjection};

/// Relative and absolute tolerance of a run.
inline SimulateOptions AtTolerance(double tolerance) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = tolerance;
  return options;
}

/// So tight that what a run misses is far below what is asked for.
inline SimulateOptions Tight() { return AtTolerance(1e-12); }

/// The vector of these entries.
inline Vector Entries(std::initializer_list<double> values) {
  return Vector::Map(values.begin(), static_cast<Eigen::Index>(values.size()));
}

}  // namespace test
}  // namespace contact_flow
