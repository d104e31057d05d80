// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/ensemble/draws.h"
#include "contact_flow/ensemble/record.h"
#include "contact_flow/ensemble/tally.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/flow/simulate_batch.h"

namespace contact_flow {

/// How far a sweep is.
struct SweepProgress {
  std::uint64_t done = 0;                 ///< runs of this request that are finished
  std::uint64_t total = 0;                ///< runs of this request
  double elapsed = 0;                     ///< [s]
  double rate = 0;                        ///< runs per second so far
  double left = 0;                        ///< time that is left at this rate [s]
  std::map<int, std::uint64_t> outcomes;  ///< counts by RunOutcome
};

/// One model from many starts.
struct SweepRequest {
  std::shared_ptr<const MechanicalSystem> system;  ///< with the values of parameters not drawn
  /// The system with these values over its own; needed where parameters are drawn.
  std::function<std::unique_ptr<MechanicalSystem>(const ParameterValues&)> make;
  Vector x;                 ///< the start that draws change [nq+d]
  InputSchedule inputs;     ///< inputs that draws change: each of its values in the same way
  double duration = 1;      ///< of each run [s]
  SimulateOptions options;  ///< of each run; max_steps ends runs at the same place on any machine
  Draws draws;              ///< what the runs differ in
  Keep keep;                ///< what is kept of them
  std::vector<HistogramAxis> histograms;  ///< of observables
  std::uint64_t first = 0;                ///< first run, a multiple of Tally::kBlock
  std::uint64_t count = 0;                ///< how many; the last block may be shorter
  int threads = 0;                        ///< 0: as many as the machine has cores
  /// Instructions that step several runs at once, where the system has them, nothing but its final
  /// state and events is kept and no parameter is drawn. Changes no bit.
  LaneSet lanes = LaneSet::kBest;
  double max_megabytes = 4000;  ///< of the columns, and of the statistics [10⁶ byte]
  /// Called by the caller's thread every so many seconds, and at the end.
  std::function<void(const SweepProgress&)> progress;
  double progress_every = 0.5;  ///< [s]
};

/// What is known of the runs [first, first + columns.rows).
struct SweepResult {
  /// kOk, or kCancelled or kBudgetExceeded: the tally has the blocks that were done by then, and
  /// the other rows are kNotRun.
  Status status;
  Columns columns;  ///< what was kept
  /// Counts and statistics. Observables are y = w [2d] with x(T) = reference ⊞ w, then costs.
  Tally tally;
  Vector reference;  ///< x(T) of the run without draws, or the start where that is not admissible
  SweepProgress progress;  ///< at the end
};

/// Names of the observables: tangents of the final state, then costs.
std::vector<std::string> ObservableNames(const MechanicalSystem& system, const Keep& keep);
/// The reference of a request.
Vector ReferenceState(const SweepRequest& request);

/// What the statistics of a request take at most, on so many threads [byte].
double StatisticsBytes(const SweepRequest& request, int threads);

/// Runs all of them, in blocks of Tally::kBlock over threads, within the Budget of the caller's
/// thread. Each run depends on its number, the seed and the request alone: columns and statistics
/// have the same bits for any number of threads and any division into requests. A run that throws,
/// a start that is not admissible, a run that exceeds its own budget, an observable that is not
/// finite: that is its outcome. Throws
/// std::invalid_argument for the request, before anything is run, and BudgetExceeded where the
/// columns, or the statistics, do not fit into max_megabytes.
SweepResult Sweep(const SweepRequest& request);

}  // namespace contact_flow
