// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "asked.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/status.h"
#include "directions.h"
#include "run_request.h"
#include "setup.h"

namespace contact_flow {

/// What a prediction starts from: the present of an online run as an initial state, with the inputs
/// to come and the directions in which it is perturbed.
struct Snapshot {
  std::shared_ptr<const Setup> setup;
  ResolvedRun run;
  Directions directions;
};
/// Throws std::invalid_argument for a request that is not in order.
Snapshot TakeSnapshot(std::shared_ptr<const Setup> setup, OnlineFlow* flow,
                      const AskedPrediction& asked);

/// The outcome of a run, and the fan of its perturbations.
struct Prediction {
  std::uint32_t epoch = 0;         ///< in which it was asked
  std::uint64_t index = 0;         ///< of the request
  Outcome outcome = Outcome::kOk;  ///< of the run or its derivative
  std::string message;             ///< why, or what there is to note
  std::vector<Warning> warnings;   ///< that the run has passed
  std::vector<DirectionNote> notes;
  double t_begin = 0;                    ///< [s]
  double t_end = 0;                      ///< [s]
  Vector q;                              ///< at t_end [nq]
  Vector v;                              ///< likewise [d]
  std::vector<std::string> modes;        ///< "{left_foot}", of each arc
  std::vector<std::string> mode_words;   ///< their letters, one a constraint
  std::vector<std::string> event_names;  ///< constraints that are hit or let go, of each event
  std::vector<double> event_times;       ///< [s]
  // Where there is a derivative:
  std::vector<std::string> direction_names;  ///< [m]
  Matrix derivatives;                        ///< B(w), one a row [m × 2d]
  Matrix fan;                                ///< x(T) ⊞ size · B(w), one a row [m × nq+d]
  Vector time_derivative;                    ///< dx/dt at t_end [2d]
};

/// The outcome of a run from the snapshot on. A function of its arguments alone, of which `asked`
/// is what the snapshot was taken for; `cancelled` as in SimulateOptions.
Prediction Predict(const Snapshot& snapshot, const AskedPrediction& asked,
                   const std::function<bool()>& cancelled);

}  // namespace contact_flow
