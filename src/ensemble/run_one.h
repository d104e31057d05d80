// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "contact_flow/budget.h"
#include "contact_flow/ensemble/sweep.h"

namespace contact_flow {

/// One run of a sweep by its number. Threads share it; each brings its scratch.
class RunOne {
 public:
  /// The parts of a thread that are used again.
  struct Scratch {
    /// Of runs within this budget, which must outlive it.
    explicit Scratch(const Budget& sweep) : budget(sweep) {}
    const Budget& budget;                      ///< of the sweep
    Vector drawn;                              ///< numbers of the run
    RunStart start;                            ///< where it starts
    std::unique_ptr<MechanicalSystem> system;  ///< with parameters of its own
    ParameterValues parameters;                ///< those that `system` was made with
  };

  /// `request` must outlive it. Throws std::invalid_argument for its names and sizes.
  RunOne(const SweepRequest& request, Vector reference);

  /// Draws, runs and records run `run` into this row. Nothing is thrown for what the run comes out
  /// as; where the budget of the thread ends meanwhile, what is recorded is not to be used.
  void Run(std::uint64_t run, std::size_t row, Scratch* scratch, Columns* columns,
           Summary* summary) const;
  /// Whether runs have lanes (simulate_batch.h).
  bool HasLanes() const { return has_lanes_; }
  /// The same, to the bit, of runs first to first + count − 1 in lanes. False, with nothing
  /// recorded, where one of them threw or the budget of the thread ended.
  bool RunLanes(std::uint64_t first, std::size_t row, std::size_t count, Scratch* scratch,
                Columns* columns, Summary* summary) const;
  /// A summary of its observables.
  Summary MakeSummary() const;
  /// What writes the columns.
  const Recorder& recorder() const { return recorder_; }

 private:
  void RunDrawn(std::uint64_t run, std::size_t row, Scratch* scratch, Columns* columns,
                Summary* summary) const;
  void Refuse(std::uint64_t run, const std::string& reason, std::size_t row, Columns* columns,
              Summary* summary) const;
  /// Counts and measures a run that was written.
  void Count(const MechanicalSystem& system, std::uint64_t run, const RunEnd& end, std::size_t row,
             Columns* columns, Summary* summary) const;
  const MechanicalSystem& SystemOf(Scratch* scratch) const;
  bool ConstantFromZero() const;

  const SweepRequest& request_;
  const Sampler sampler_;
  const StartMap start_;
  const Recorder recorder_;
  const Vector reference_;
  SimulateOptions options_;
  bool has_lanes_ = false;
};

}  // namespace contact_flow
