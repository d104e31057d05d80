// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/flow/simulate.h"

namespace contact_flow {

/// Which instructions step several runs of a batch at once.
enum class LaneSet {
  kBest,   ///< the widest that this machine and the model have
  kNone,   ///< one run at a time, by Simulate
  kAvx2,   ///< 4 lanes, or one run at a time where the machine has none
  kAvx512  ///< 8 lanes, likewise
};

/// How a batch is worked through. Nothing of it changes a bit of the results.
struct BatchOptions {
  int threads = 1;                 ///< ≥ 1
  LaneSet lanes = LaneSet::kBest;  ///< which instructions
};

/// A cluster of events that a run of a batch has passed; see Transition.
struct BatchEvent {
  double t = 0;             ///< [s]
  ConstraintSet activated;  ///< what hit
  ConstraintSet released;   ///< what let go
  ContactMode mode_after;   ///< J⁺
  Vector impulse;           ///< [n+l] [N·s]
};

/// What is kept of one run of a batch: numbers of the Trajectory that Simulate gives, to the bit.
struct BatchRun {
  Status status;                   ///< how it ended
  std::string refused;             ///< why its start was refused, as Simulate throws; else ""
  double t_end = 0;                ///< [s]
  Vector final_state;              ///< [nq+d]; empty where the start was refused
  Vector error;                    ///< estimated errors added up in its last arc [2d], Arc::error
  ContactMode first_mode;          ///< contact mode of the start
  std::vector<BatchEvent> events;  ///< in the order of time
  Margins margins;                 ///< as Trajectory
  RunStatistics statistics;        ///< as Trajectory
  double accumulation_time = std::numeric_limits<double>::quiet_NaN();  ///< as Trajectory
  std::vector<Warning> warnings;  ///< the first Trajectory::kMaxWarnings
  long num_warnings = 0;          ///< all of them
  bool alone = false;             ///< it was made by Simulate, and not in a lane
};

/// The runs of a batch, in the order of their starts.
struct BatchResult {
  std::vector<BatchRun> runs;  ///< one for each start, in their order
  int width = 1;               ///< lanes; 1: every run was made alone
  long alone = 0;   ///< runs made by Simulate: what lanes do not offer, such as a Zeno run
  std::string why;  ///< why there are no lanes; "" where there are
};

/// Many runs of one system, each as Simulate makes it with dense = false: runs of template models
/// with constant M and Da and without friction take their steps 4 or 8 at a time in the lanes of
/// AVX2 or AVX-512. A lane has its own time, step, error control and contact mode, and takes the
/// next start when its run has ended. What lanes do not offer is run alone.
///
/// Results have the bits of single runs, whatever the lanes, threads and neighbours, as each lane
/// rounds as those do; where the library was compiled to contract a·b + c (-march=native), single
/// runs round otherwise, and the two differ by rounding. States are columns [nq+d × runs], inputs
/// columns [m × runs], or one for all. Throws std::invalid_argument for sizes and options; what
/// Simulate would throw for one start is in its BatchRun.
BatchResult SimulateBatch(const MechanicalSystem& system, const MatrixRef& states,
                          const MatrixRef& inputs, double duration,
                          const SimulateOptions& options = {}, const BatchOptions& batch = {});

}  // namespace contact_flow
