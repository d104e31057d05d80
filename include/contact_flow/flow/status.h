// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace contact_flow {

/// How a simulation, or a derivative, came out. Anything but kOk is an answer with a reason, not an
/// error: the trajectory up to there is kept. Misuse (wrong size, unknown name, a penetrating
/// initial state) throws std::invalid_argument instead, before anything is computed.
enum class Outcome {
  kOk = 0,
  kGrazing = 1,         ///< a constraint was touched with vanishing speed: not admissible (Def. 3)
  kZeno = 2,            ///< impacts accumulate at a finite time (Def. 2 fails)
  kBudgetExceeded = 3,  ///< more steps, events or seconds than the options allow
  kNonFinite = 4,       ///< the motion left the domain of the model (NaN, Inf, singular M)
  kCancelled = 5,       ///< the caller asked to stop
  kDiscontinuous = 6,   ///< simultaneous contacts whose order decides the outcome: no derivative
  kNotDifferentiable = 7,  ///< another hypothesis of Theorem 1 fails; the message says which
  kTooManyPieces = 8,      ///< all pieces were asked for and there are more than the stated limit
  kFilippov =
      9,  ///< the effort switches so that the motion would slide, or is not unique (Filippov)
};

/// "ok", "grazing", "zeno", …
const char* OutcomeName(Outcome outcome);

/// An outcome with the sentence that explains it (empty when kOk).
struct Status {
  Outcome outcome = Outcome::kOk;
  std::string message;

  bool ok() const { return outcome == Outcome::kOk; }
};

/// What a run has passed and gone on from, and what derivatives across it do not: a graze, …
struct Warning {
  Outcome code = Outcome::kOk;
  double t = 0;  ///< [s]
  std::string message;
};

}  // namespace contact_flow
