// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/ApplyImpulse.h"
#include "contact_flow/AssumptionRequest.h"
#include "contact_flow/ComparisonRequest.h"
#include "contact_flow/ControllabilityRequest.h"
#include "contact_flow/CovarianceRequest.h"
#include "contact_flow/DerivativeRequest.h"
#include "contact_flow/EnsembleRequest.h"
#include "contact_flow/GradientRequest.h"
#include "contact_flow/LinearizationRequest.h"
#include "contact_flow/OptimizationRequest.h"
#include "contact_flow/PeriodicOrbitRequest.h"
#include "contact_flow/PolicyRequest.h"
#include "contact_flow/RunCondition.h"
#include "contact_flow/SetInput.h"
#include "contact_flow/SetSimulatorParameters.h"
#include "contact_flow/SetSimulatorState.h"
#include "contact_flow/SimulationRequest.h"
#include "contact_flow/StabilityRequest.h"
#include "contact_flow/StepFeedbackRequest.h"
#include "contact_flow/TrajectoryRequest.h"
#include "src/session/setup.h"
#include "test/fuzz/message_mutation.h"

namespace contact_flow {
namespace fuzz {

namespace ros_if = ros_interface;

constexpr double kDuration = 0.05;

/// The node's limits are for minutes; here thousands of requests are to be answered in one. What is
/// out of range stays so.
template <class Count>
void Limit(Count* count, Count largest, Count most = 100000000) {
  if (*count == 0 || (*count > largest && *count <= most)) *count = largest;
}
inline void Shorten(SimulationOptions* options) {
  Limit<std::int64_t>(&options->max_steps, 2000, kMaxSteps);
  Limit<std::int64_t>(&options->max_events, 200, kMaxEvents);
}
template <class Request>
void Shorten(Request* request) {
  Shorten(&request->options);
}
inline void Shorten(SimulationRequest* request) {
  Shorten(&request->options);
  if (request->samples <= 100000) request->samples %= 1000;
}
inline void Shorten(StabilityRequest* request) {
  Shorten(&request->return_map.options);
  Limit<std::uint32_t>(&request->max_words, 500);
  Limit<std::uint32_t>(&request->max_linear_programs, 500);
}
inline void Shorten(StepFeedbackRequest* request) {
  Shorten(&request->return_map.options);
  Limit<std::uint32_t>(&request->max_words, 500);
  Limit<std::uint32_t>(&request->max_linear_programs, 500);
}
inline void Shorten(ControllabilityRequest* request) {
  Shorten(&request->options);
  Limit<std::uint32_t>(&request->max_linear_programs, 500);
}
inline void Shorten(PeriodicOrbitRequest* request) {
  Shorten(&request->options);
  Limit<std::uint32_t>(&request->max_iterations, 5);
}
inline void Shorten(OptimizationRequest* request) {
  Shorten(&request->options);
  Limit<std::uint32_t>(&request->max_iterations, 5);
}
inline void Shorten(TrajectoryRequest* request) {
  Shorten(&request->options);
  Limit<std::uint32_t>(&request->max_iterations, 3);
}
inline void Shorten(EnsembleRequest* request) {
  Shorten(&request->options);
  Limit<std::uint64_t>(&request->runs, 300);
  Limit<std::uint32_t>(&request->threads, 2);
}

/// Good requests of every kind for one model, which are then made hostile.
class RequestSeeds {
 public:
  explicit RequestSeeds(const std::string& model) : setup(Configured(model)) {
    const SystemDescription& names = setup.system->description();
    for (const auto* list :
         {&names.coordinates, &names.velocities, &names.inputs, &names.constraints}) {
      words.insert(words.end(), list->begin(), list->end());
    }
    for (const Parameter& parameter : names.parameters) words.push_back(parameter.name);
    for (const char* word :
         {"apex", "coordinate", "velocity", "touchdown", "clock", "period", "liftoff", "projection",
          "complementarity", "input", "grid", "uniform", "normal", "table", "start", "jacobian"}) {
      words.push_back(word);
    }
    good.duration = kDuration;
  }
  static Configuration Configured(const std::string& model) {
    Configuration configuration;
    configuration.model = model;
    configuration.options.max_seconds = 2;
    return configuration;
  }

  template <class Run>  // a run without more
  void Fill(MessageMutator* dice, Run* request) const {
    BeginRun(dice, request);
  }
  void Fill(MessageMutator* dice, DerivativeRequest* request) const {
    BeginRun(dice, request);
    AddDirections(dice, request);
    request->all_pieces = dice->Below(2) == 0;
  }
  void Fill(MessageMutator* dice, ComparisonRequest* request) const {
    BeginRun(dice, request);
    AddDirections(dice, request);
    request->alphas = {1e-3, 1e-5};
  }
  void Fill(MessageMutator* dice, AssumptionRequest* request) const {
    BeginRun(dice, request);
    request->region_samples = 10;
  }
  void Fill(MessageMutator* dice, PoincareRequest* request) const {
    BeginReturn(dice, request);
    if (dice->Below(3) == 0) request->neutral = Square(2 * setup.system->dof());
  }
  void Fill(MessageMutator* dice, StabilityRequest* request) const {
    Fill(dice, &request->return_map);
    if (dice->Below(4) > 0) request->map = Map();
    if (dice->Below(2) != 0) return;
    request->certificate.test = static_cast<std::uint8_t>(dice->Below(9));
    request->certificate.bound = 0.9;
    request->certificate.norm = Square(3);
    request->certificate.directions = Square(1);
    request->certificate.words.resize(2);
    for (PieceWord& word : request->certificate.words) word.pieces = {0, 1};
  }
  void Fill(MessageMutator* dice, StepFeedbackRequest* request) const {
    Fill(dice, &request->return_map);
    const auto& inputs = setup.system->description().inputs;
    if (dice->Below(2) == 0 && !inputs.empty()) request->inputs = {inputs.front()};
    request->piecewise = dice->Below(2) == 0;
  }
  void Fill(MessageMutator* dice, ControllabilityRequest* request) const {
    BeginRun(dice, request);
    if (dice->Below(2) == 0) request->map = Map();
  }
  void Fill(MessageMutator* dice, CovarianceRequest* request) const {
    BeginRun(dice, request);
    request->deviations.assign(static_cast<std::size_t>(2 * setup.system->dof()), 0.01);
  }
  void Fill(MessageMutator* dice, PeriodicOrbitRequest* request) const {
    BeginReturn(dice, request);
    request->max_iterations = 3;
  }
  void Fill(MessageMutator* dice, OptimizationRequest* request) const {
    Begin(dice, request);
    request->duration = kDuration;
    request->unknowns = {Coordinate(dice)};
    request->outcomes = {Coordinate(dice)};
    request->targets = {0.5};
  }
  void Fill(MessageMutator* dice, GradientRequest* request) const {
    BeginRun(dice, request);
    request->outcomes = request->path_outcomes = {Coordinate(dice)};
  }
  void Fill(MessageMutator* dice, PolicyRequest* request) const {
    BeginRun(dice, request);
    request->input_grid.times = {0, 0.01, 0.03};
    if (dice->Below(2) == 0) request->reach = 0.02;
    if (dice->Below(3) == 0) request->state_weights.assign(2 * V().size(), 1);
    if (dice->Below(3) == 0) request->upper.assign(U().size(), 1);
  }
  void Fill(MessageMutator* dice, TrajectoryRequest* request) const {
    Begin(dice, request);
    request->duration = kDuration;
    request->input_grid.times = {0, 0.01, 0.03};
    if (dice->Below(3) == 0) request->initial = {"d/dt " + Coordinate(dice)};
    if (dice->Below(2) == 0) request->parameters = {AnyParameter(dice).name};
    if (dice->Below(2) == 0) request->durations = {1};
    request->keep_horizon = dice->Below(2) == 0;
    request->outcomes = request->path = {Coordinate(dice)};
    request->targets = request->path_targets = {0.5};
    request->duration_weight = 1;
    const SystemDescription& names = setup.system->description();
    request->linear_inputs = dice->Below(3) == 0;
    if (dice->Below(3) == 0 && !names.inputs.empty()) {
      request->power_inputs = {names.inputs.front()};
      request->power_velocities = {names.velocities[dice->Below(names.velocities.size())]};
      request->power_weights = {0.5};
    }
    if (dice->Below(4) == 0) request->impulses = {names.constraints.front()};
    if (dice->Below(4) == 0) request->slips = {names.constraints.front()};
    RunCondition condition;
    condition.name = Coordinate(dice);
    condition.lower = -1;
    condition.upper = 10;
    condition.every_instant = dice->Below(2) == 0;
    if (dice->Below(2) == 0) request->conditions = {condition};
    if (dice->Below(4) > 0) return;
    condition.touchdown = true;
    condition.name = names.constraints.front();
    request->conditions.push_back(condition);
  }
  void Fill(MessageMutator* dice, EnsembleRequest* request) const {
    BeginRun(dice, request);
    request->runs = 5;
    const std::string name = Coordinate(dice);
    EnsembleDraw draw;
    draw.names = {(dice->Below(2) == 0 ? "+" : "") + name};
    const auto kind = dice->Below(4);
    draw.kind = kind == 0 ? "grid" : kind == 1 ? "uniform" : kind == 2 ? "normal" : "table";
    if (kind == 0) draw.levels = {0.1, 0.2};
    if (kind == 1) draw.low = {0}, draw.high = {0.1};
    if (kind == 2) draw.deviations = {0.1};
    if (kind == 3) draw.table = Square(1);
    request->draws = {draw};
    if (dice->Below(2) == 0) request->keep = {"outcome", "start", "final_state", "words"};
    request->sobol = dice->Below(4) == 0;
    request->events = static_cast<std::uint32_t>(dice->Below(3));
    if (dice->Below(3) == 0) request->samples = {0.01, 0.02};
    request->costs.resize(dice->Below(2));
    for (EnsembleCost& cost : request->costs) cost.outcomes = {name};
    request->histograms.resize(dice->Below(2));
    for (EnsembleBins& axis : request->histograms) {
      axis.observable = name;
      axis.high = 1;
      axis.bins = 4;
    }
    if (dice->Below(4) > 0) return;
    request->directions.rows = 1;
    request->directions.cols = static_cast<std::uint32_t>(2 * setup.system->dof());
    request->directions.data.assign(request->directions.cols, 0.1);
  }
  void Fill(MessageMutator*, SetSimulatorState::Request* request) const {
    request->state.q = Q();
    request->state.v = V();
  }
  void Fill(MessageMutator*, ApplyImpulse::Request* request) const {
    request->names = {setup.system->description().velocities.front()};
    request->impulse = {0.1};
  }
  void Fill(MessageMutator* dice, SetSimulatorParameters::Request* request) const {
    const Parameter& one = AnyParameter(dice);
    request->names = {one.name};
    request->values = {one.value};
  }
  void Fill(MessageMutator*, SetInput::Request* request) const { request->values = U(); }

  template <class Request>
  void AddDirections(MessageMutator* dice, Request* request) const {
    request->directions = {"+" + Coordinate(dice), "-d/dt " + Coordinate(dice)};
    if (dice->Below(2) == 0) {
      const auto cols = static_cast<std::uint32_t>(2 * setup.system->dof());
      request->direction_matrix.rows = 1;
      request->direction_matrix.cols = cols;
      request->direction_matrix.data.assign(cols, 0.1);
    }
    request->project_directions = dice->Below(2) == 0;
  }

  std::vector<double> Q() const { return Part(0, setup.system->num_positions()); }
  std::vector<double> V() const { return Part(setup.system->num_positions(), setup.system->dof()); }
  std::vector<double> U() const {
    const Vector& u = setup.system->nominal().u;
    return {u.data(), u.data() + u.size()};
  }

  const Setup setup;
  std::vector<std::string> words;
  SimulationRequest good;

 private:
  const Parameter& AnyParameter(MessageMutator* dice) const {
    const auto& all = setup.system->description().parameters;
    return all[dice->Below(all.size())];
  }
  std::vector<double> Part(int begin, int count) const {
    const Vector& x = setup.system->nominal().x;
    return {x.data() + begin, x.data() + begin + count};
  }
  std::string Coordinate(MessageMutator* dice) const {
    const auto& names = setup.system->description().coordinates;
    return names[dice->Below(names.size())];
  }
  static RowMajorMatrix Square(int n) {
    RowMajorMatrix matrix;
    matrix.rows = matrix.cols = static_cast<std::uint32_t>(n);
    matrix.data.assign(static_cast<std::size_t>(n * n), 0);
    for (int i = 0; i < n; ++i) matrix.data[static_cast<std::size_t>(i * n + i)] = 0.5;
    return matrix;
  }
  static std::vector<DerivativePiece> Map() {
    std::vector<DerivativePiece> map(2);
    for (int k = 0; k < 2; ++k) {
      map[k].matrix = Square(3);
      map[k].cone.rows = 1;
      map[k].cone.cols = 3;
      map[k].cone.data = {k == 0 ? 1.0 : -1.0, 0, 0};
    }
    return map;
  }
  template <class Request>
  void Begin(MessageMutator* dice, Request* request) const {
    if (dice->Below(2) == 0) {
      request->state.q = Q();
      request->state.v = V();
    } else if (dice->Below(2) == 0) {
      request->state.names = {Coordinate(dice)};
      request->state.positions = {0.5};
    }
    if (dice->Below(3) == 0) request->input = U();
  }
  template <class Request>
  void BeginRun(MessageMutator* dice, Request* request) const {
    Begin(dice, request);
    request->duration = kDuration;
    if (dice->Below(3) == 0) request->input_grid.times = {0, 0.01, 0.03};
  }
  template <class Request>
  void BeginReturn(MessageMutator* dice, Request* request) const {
    Begin(dice, request);
    request->section.kind = "apex";
    request->section.name = setup.system->description().velocities.back();
    request->horizon = 0.3;
  }
};

}  // namespace fuzz
}  // namespace contact_flow
