// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sstream>
#include <stdexcept>

#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "src/dynamics/mode_selection.h"

namespace contact_flow {

inline Outcome OutcomeOf(FrictionRefusal::Kind kind) {
  using Kind = FrictionRefusal::Kind;
  switch (kind) {
    case Kind::kInconsistent:
      return Outcome::kPainleveInconsistent;
    case Kind::kIndeterminate:
      return Outcome::kPainleveIndeterminate;
    case Kind::kIndeterminateForces:
      return Outcome::kIndeterminateForces;
    case Kind::kNoImpact:
      return Outcome::kNoConsistentImpact;
    case Kind::kAmbiguousImpact:
      return Outcome::kAmbiguousImpact;
    case Kind::kEnergyGain:
      return Outcome::kEnergyGain;
    case Kind::kSlipFromRestInSpace:
      return Outcome::kNotPiecewiseLinear;
  }
  return Outcome::kNonFinite;
}

/// Resolves a transition at t [s]; what keeps it from being resolved becomes a status.
template <class Function>
Status Guarded(double t, const Function& resolve) {
  const auto sentence = [t](const char* separator, const std::exception& reason) {
    std::ostringstream message;
    message.precision(12);
    message << "at t = " << t << " s" << separator << reason.what();
    return message.str();
  };
  try {
    resolve();
  } catch (const FrictionRefusal& reason) {
    return {OutcomeOf(reason.kind), sentence(": ", reason)};
  } catch (const UndecidedMode& reason) {
    return {Outcome::kFilippov, sentence(": ", reason)};
  } catch (const std::domain_error& reason) {
    return {Outcome::kNonFinite, sentence(" ", reason)};
  }
  return {};
}

/// Says in its obstacle that the contacts of J⁺ and those it implies are dependent, if any are.
void NoteImplied(const MechanicalSystem& system, Transition* transition);

}  // namespace contact_flow
