// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/flow/trajectory.h"
#include "test/adversary/generator.h"
#include "test/adversary/reference_flow.h"

namespace contact_flow {
namespace adversary {

/// One case, run by the library and by the reference.
class Trial {
 public:
  enum Steps { kUsual, kFine };

  explicit Trial(const Case& c) : c_(c), given_(*c.system, c.units) {}

  /// The system in the units in which the library sees it.
  const RescaledSystem& given() const { return given_; }
  /// A direction w = (δq, δv, δu, δp) in these units.
  Vector Given(const Vector& w) const;

  /// The reference's mode at the start.
  ConstraintSet InitialMode(std::string* doubt) const;
  /// The reference from the start perturbed by w, which contacts `kept` hold.
  ReferenceRun Reference(const Vector& w, ConstraintSet kept, Steps steps = kUsual) const;
  /// The library's run, in its units; max_step in the case's.
  Trajectory Simulated(double max_step) const;
  /// Whether a touchdown of such a run follows another so closely that to the reference its gap had
  /// closed with that one.
  bool ReferenceMerges(const Trajectory& run) const;

 private:
  const Case& c_;
  RescaledSystem given_;
};

}  // namespace adversary
}  // namespace contact_flow
