// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/dop853.h"
#include "contact_flow/flow/error_tally.h"
#include "contact_flow/flow/event_locator.h"
#include "contact_flow/flow/implied_gaps.h"
#include "contact_flow/flow/simulate_batch.h"
#include "contact_flow/flow/stopped_gaps.h"
#include "contact_flow/flow/transition.h"
#include "contact_flow/flow/zeno_detector.h"
#include "lane_set.h"
#include "lane_transition.h"
#include "lane_view.h"

namespace contact_flow {

/// What the runs of a batch share.
struct BatchRequest {
  const MechanicalSystem& system;
  const MatrixRef& states;
  const MatrixRef& inputs;
  double duration;
  const SimulateOptions& options;

  auto Input(std::size_t run) const {
    return inputs.col(inputs.cols() == 1 ? 0 : static_cast<Eigen::Index>(run));
  }
  /// By Simulate.
  BatchRun RunAlone(std::size_t run) const;
};

/// The runs in the lanes of one block. Each lane follows Flow: Propose, Attempt, StepOntoEvent,
/// Accept and PassTransition, with the steps of all lanes taken at once. Where Flow would do more
/// than is done here the run is made alone, from its beginning.
class LaneRuns {
 public:
  LaneRuns(const BatchRequest& request, std::unique_ptr<LaneStepper> stepper);

  /// Takes starts by their numbers until there are none, and writes their results.
  void Run(std::atomic<std::size_t>* next, std::vector<BatchRun>* results);

 private:
  /// What a run begins with.
  struct Counts {
    double began = 0;  // processor time [s]
    double t = 0, arc_begin = 0;
    double quick_end = -std::numeric_limits<double>::infinity(), quick_step = 0;
    bool new_arc = false;
    std::optional<double> last_transition;
    int last_trigger = -1;
    long evaluations = 0, attempts = 0, steps = 0;
    int stiff_steps = 0, soft_steps = 0;
  };
  struct Lane : Counts {
    explicit Lane(const MechanicalSystem& system) : start_error(system.space()) {}
    bool busy = false;
    std::size_t run = 0;
    BatchRun result;
    // The node.
    double h = 0;
    Vector x, u;
    ContactMode mode;
    const ModeMaps* maps = nullptr;
    GapSample begin;
    GuardMargins margins;
    std::optional<ForceMinima> force_minima;
    std::optional<StoppedGaps> stopped;
    ErrorTally start_error;  // of the arc before, where this one begins
    Margins run_margins;
    std::optional<ZenoDetector> zeno;
    // The proposal.
    double try_h = 0, length = 0, rest = 0, next_quick_end = 0, next_quick_step = 0;
    bool rejected = false;
    GuardMargins next_margins;
    // On the way onto an event.
    bool onto = false, redo = false;
    LocatedEvent event;
    double s = 0, nearest = 0, least = 0;
    int iteration = 0;
  };

  double At(const double* rows, int row, int lane) const { return rows[row * width_ + lane]; }
  double Force(int place, int i, int lane) const {
    return At(arrays_.forces, place * n_ + i, lane);
  }
  Lane& lane(int k) { return lanes_[static_cast<std::size_t>(k)]; }

  void Fill(int k);
  bool Start(int k);
  bool BeginArc(int k);
  bool Propose(int k);
  bool Attempt(int k);
  bool Settle(int k);
  bool SettleOnto(int k);
  bool EndOnto(int k);
  bool Repeat(int k, double h);
  bool Accept(int k);
  bool PassTransition(int k);
  bool TallyTransition(int k, const Transition& transition);
  bool Accumulates(int k, const ResolvedTransition& resolved);
  void ForgetLow(Lane* lane) const;
  bool IsClear(int k, bool free, double* growth);
  bool ForcesAreClear(int k, double* growth);
  double LargestForce(int k) const;
  void NoteForces(int k);
  LocatedEvent Locate(int k, bool free);
  bool Implies(const Lane& lane);
  bool Drifts(int k);
  bool Penetrates(const Lane& lane) const;
  bool IsStiff(int k);
  void CountStep(int k);
  void End(int k);
  void Warn(Lane* lane, const Warning& warning) const;
  void Finish(int k);
  const ModeMaps& MapsOf(const Lane& lane);
  void Use(const Lane& lane);
  void LoadGaps(int k, GapSample* sample);
  void Write(const double* from, int rows, double* to, int k) const;

  const BatchRequest& request_;
  const MechanicalSystem& system_;
  const SimulateOptions& options_;
  const std::unique_ptr<LaneStepper> stepper_;
  const LaneArrays& arrays_;
  const int width_, d_, n_;
  ContactDynamics dynamics_;
  ContactMode mode_;  // of the lane that is looked at
  Dop853 starter_;
  const Guards guards_;
  EventLocator locator_;
  LaneView view_;
  PlasticTouchdown touchdown_;
  ErrorTally arc_error_;  // of a lane at its event
  /// Touching contacts beside a mode, and whether it implies any: Da does not change.
  struct NearContacts {
    ContactMode mode;
    ConstraintSet near;
    bool implied;
  };

  std::deque<ModeMaps> maps_;
  std::vector<NearContacts> near_;
  std::vector<Lane> lanes_;
  std::atomic<std::size_t>* next_ = nullptr;
  std::vector<BatchRun>* results_ = nullptr;
  ConstraintTerms terms_;
  GapSample end_;
  Vector x_end_, force_;
};

}  // namespace contact_flow
