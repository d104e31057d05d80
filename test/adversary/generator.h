// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/simulate.h"
#include "test/adversary/random_system.h"
#include "test/adversary/rescaled_system.h"

namespace contact_flow {
namespace adversary {

/// A random run: a system in units of order 1, whose motion is known to a reference simulator, and
/// the units in which it is given to the library.
struct Case {
  std::uint64_t seed = 0;
  std::string generator;
  /// Why there is no case; empty when there is one.
  std::string skipped;
  std::shared_ptr<RandomSystem> system;
  Units units;
  Vector x;  ///< [2d]
  InputSchedule schedule;
  double duration = 1;
  double event_time = 0;    ///< of the event that was built [s]
  double delay = 0;         ///< between events that are nearly simultaneous, else 0 [s]
  SimulateOptions options;  ///< in units of order 1
};

/// The names of all generators; seed s belongs to number s mod size.
const std::vector<std::string>& GeneratorNames();

/// The same case for the same seed.
Case Generate(std::uint64_t seed);
/// The same, of which some run by other methods, and by tolerances that are not the usual ones.
Case GenerateWithOptions(std::uint64_t seed);

/// All numbers of a case, to be read by people.
std::string Print(const Case& c);

}  // namespace adversary
}  // namespace contact_flow
