// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/budget.h"

namespace contact_flow {

/// How a simulation, or a derivative, came out. Anything but kOk is an answer with a reason, not an
/// error: the trajectory up to there is kept. Misuse (wrong size, unknown name, a penetrating
/// initial state) throws std::invalid_argument instead, before anything is computed.
enum class Outcome {
  kOk = 0,
  /// A constraint was touched with vanishing speed, or let go with dλ/dt = 0: not admissible (Def.
  /// 3). The motion goes on, with a Warning; no derivative across it.
  kGrazing = 1,
  kZeno = 2,               ///< impacts accumulate at a finite time (Def. 2 fails)
  kBudgetExceeded = 3,     ///< more steps, events or seconds than the options allow
  kNonFinite = 4,          ///< the motion left the domain of the model (NaN, Inf, singular M)
  kCancelled = 5,          ///< the caller asked to stop
  kDiscontinuous = 6,      ///< simultaneous contacts whose order decides the outcome: no derivative
  kNotDifferentiable = 7,  ///< another hypothesis of Theorem 1 fails; the message says which
  kTooManyPieces = 8,      ///< all pieces were asked for and there are more than the stated limit
  /// The effort switches so that the motion would slide, or is not unique (Filippov).
  kFilippov = 9,
  // With friction:
  kPainleveInconsistent = 10,   ///< no contact forces exist
  kPainleveIndeterminate = 11,  ///< several contact modes fit, with different motions
  kPainleveCrossing = 12,       ///< the Delassus matrix of a slipping mode becomes singular
  kIndeterminateForces = 13,    ///< the rows of what sticks are dependent: no unique forces
  kNoConsistentImpact = 14,     ///< no impulses end an impact
  kAmbiguousImpact = 15,        ///< several do, with different velocities
  kEnergyGain = 16,             ///< an impact would add energy
  kNotPiecewiseLinear = 17,     ///< the outcome has directional derivatives, but no linear pieces
  kChatter = 18,                ///< events follow each other without time between them
};

/// "ok", "grazing", "zeno", …
const char* OutcomeName(Outcome outcome);

/// An outcome with the sentence that explains it (empty when kOk).
struct Status {
  Outcome outcome = Outcome::kOk;  ///< how it came out
  std::string message;             ///< why, as a sentence

  /// Whether all is well.
  bool ok() const { return outcome == Outcome::kOk; }
};

/// kCancelled, or else kBudgetExceeded.
inline Outcome OutcomeOf(const BudgetExceeded& reason) {
  return reason.end() == BudgetEnd::kCancelled ? Outcome::kCancelled : Outcome::kBudgetExceeded;
}

/// Something on the way of a run that went on: a touch with vanishing speed (kGrazing), bounces
/// that were completed to rest (kZeno), an impact whose outcome is not continuous (kDiscontinuous)
/// or whose impulses are not unique (kNotDifferentiable).
struct Warning {
  Outcome code = Outcome::kOk;  ///< of what it passed
  double t = 0;                 ///< [s]
  std::string message;          ///< what happened, as a sentence
};

}  // namespace contact_flow
