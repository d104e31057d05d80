// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/constraint_set.h"
#include "contact_flow/types.h"
#include "test/adversary/reference_flow.h"
#include "test/adversary/trial.h"

namespace contact_flow {
namespace adversary {

/// What quotients of the reference at other perturbations, and by other steps, say of one
/// that contradicts.
class Quotients {
 public:
  /// A quotient that is off by this part of what another is off by is right beside it.
  static constexpr double kSmall = 0.05;

  explicit Quotients(const Trial& trial) : trial_(trial) {}
  /// Contacts that hold at the start.
  void Keep(ConstraintSet kept) { kept_ = kept; }

  /// Events whose distance vanishes to second order are one to the reference once α is small: then
  /// it is a larger α that tells, or the limit of two. A bounce too low to matter to first order
  /// wants a smaller one.
  bool SayOtherwise(const ReferenceRun& base, const Vector& w, const Vector& prediction,
                    double error) const;
  /// The reference with other steps says the same, at α and α/2; `moved` is αw.
  bool AreSure(const ReferenceRun& base, const Vector& moved, double alpha, double error) const;

 private:
  ReferenceRun Run(const Vector& w, Trial::Steps steps = Trial::kUsual) const {
    return trial_.Reference(w, kept_, steps);
  }

  const Trial& trial_;
  ConstraintSet kept_;
};

}  // namespace adversary
}  // namespace contact_flow
