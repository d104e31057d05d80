// SPDX-License-Identifier: BSD-3-Clause
#include "ensemble_problem.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "analysis_messages.h"
#include "contact_flow/io/configuration.h"
#include "contact_flow/nearest_name.h"
#include "request.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr std::uint64_t kMaxRuns = 1000000000000;
constexpr std::uint32_t kMaxEvents = 1000000, kMaxBins = 1000000;
using Kind = DrawPart::Kind;

std::string Place(const std::string& field, std::size_t k) {
  return field + "[" + std::to_string(k) + "]";
}

template <class Entries>
void CheckCount(const std::string& field, const Entries& entries) {
  if (entries.size() <= kMaxEnsembleParts) return;
  throw std::invalid_argument(field + " has " + std::to_string(entries.size()) +
                              " entries, at most " + std::to_string(kMaxEnsembleParts) +
                              " are accepted");
}

/// Throws where a field is given that draws of this kind have not.
void CheckUnused(const std::string& field, const std::string& kind, bool given) {
  if (given) throw std::invalid_argument(field + " is not of a draw of kind " + kind);
}

Matrix ResolveCovariance(const std::string& field, const EnsembleDraw& draw) {
  if (draw.deviations.empty()) return ToMatrix(field + ".covariance", draw.covariance);
  CheckUnused(field + ".covariance", "normal with deviations", !draw.covariance.data.empty());
  CheckSize(field + ".deviations", draw.deviations.size(), draw.names.size(), draw.names);
  CheckWeights(field + ".deviations", draw.deviations);
  return FromMsg(draw.deviations).cwiseAbs2().asDiagonal();
}

DrawPart ResolveDraw(const std::string& field, const EnsembleDraw& draw) {
  static const std::vector<std::string> kinds = {"grid", "uniform", "normal", "table"};
  DrawPart part;
  part.kind = static_cast<Kind>(NameIndex(field + ".kind", "kind of draw", draw.kind, kinds));
  part.names = draw.names;
  const bool uniform = part.kind == Kind::kUniform, normal = part.kind == Kind::kNormal;
  CheckUnused(field + ".low", draw.kind, !uniform && !draw.low.empty());
  CheckUnused(field + ".high", draw.kind, !uniform && !draw.high.empty());
  CheckUnused(field + ".mean", draw.kind, !normal && !draw.mean.empty());
  CheckUnused(field + ".deviations", draw.kind, !normal && !draw.deviations.empty());
  CheckUnused(field + ".covariance", draw.kind, !normal && !draw.covariance.data.empty());
  CheckUnused(field + ".levels", draw.kind, part.kind != Kind::kGrid && !draw.levels.empty());
  CheckUnused(field + ".table", draw.kind, part.kind != Kind::kTable && !draw.table.data.empty());
  if (part.kind == Kind::kGrid) {
    if (draw.names.size() != 1) {
      throw std::invalid_argument(field + " is a grid of " + std::to_string(draw.names.size()) +
                                  " names, expected one; several are several draws");
    }
    part.levels = {FromMsg(draw.levels)};
  } else if (uniform) {
    part.low = FromMsg(draw.low);
    part.high = FromMsg(draw.high);
  } else if (normal) {
    part.mean = draw.mean.empty()
                    ? Vector(Vector::Zero(static_cast<Eigen::Index>(draw.names.size())))
                    : FromMsg(draw.mean);
    part.covariance = ResolveCovariance(field, draw);
  } else {
    part.table = ToMatrix(field + ".table", draw.table);
  }
  return part;
}

CostTerm ResolveCost(const MechanicalSystem& system, const std::string& field,
                     const EnsembleCost& asked) {
  CostTerm cost;
  cost.name = asked.name;
  cost.target = cost.weight = Vector::Zero(system.state_size());
  cost.effort = Vector::Zero(system.num_inputs());
  if (!asked.targets.empty()) {
    CheckSize(field + ".targets", asked.targets.size(), asked.outcomes.size(), asked.outcomes);
  }
  if (!asked.weights.empty()) {
    CheckSize(field + ".weights", asked.weights.size(), asked.outcomes.size(), asked.outcomes);
    CheckWeights(field + ".weights", asked.weights);
  }
  for (std::size_t k = 0; k < asked.outcomes.size(); ++k) {
    const int i =
        StateIndex(Place(field + ".outcomes", k), asked.outcomes[k], system.description());
    cost.weight(i) = asked.weights.empty() ? 1 : asked.weights[k];
    cost.target(i) = asked.targets.empty() ? 0 : asked.targets[k];
  }
  if (!asked.effort.empty()) {
    const std::vector<std::string>& inputs = system.description().inputs;
    CheckSize(field + ".effort", asked.effort.size(), inputs.size(), inputs);
    CheckWeights(field + ".effort", asked.effort);
    cost.effort = FromMsg(asked.effort);
  }
  return cost;
}

Keep ResolveKeep(const Setup& setup, const EnsembleRequest& request) {
  static const std::vector<std::string> known = {"outcome", "start",   "final_state", "end_time",
                                                 "words",   "margins", "jacobian"};
  Keep keep;
  bool* const fields[] = {&keep.outcome, &keep.start,   &keep.final_state, &keep.end_time,
                          &keep.words,   &keep.margins, &keep.jacobian};
  for (bool* field : fields) *field = false;
  for (std::size_t k = 0; k < request.keep.size(); ++k) {
    *fields[NameIndex(Place("keep", k), "column", request.keep[k], known)] = true;
  }
  if (request.events > kMaxEvents) {
    throw std::invalid_argument("events is " + std::to_string(request.events) +
                                ", expected at most " + std::to_string(kMaxEvents));
  }
  keep.events = static_cast<int>(request.events);
  keep.samples = request.samples;
  const MechanicalSystem& system = *setup.system;
  if (!request.directions.data.empty()) {
    const Matrix rows = ToMatrix("directions", request.directions);
    if (rows.cols() != 2 * system.dof()) {
      throw std::invalid_argument("directions has " + std::to_string(rows.cols()) +
                                  " columns, expected " + std::to_string(2 * system.dof()) +
                                  ", in the order (δq, δv)");
    }
    for (Eigen::Index k = 0; k < rows.rows(); ++k) keep.directions.push_back(rows.row(k));
  }
  CheckCount("costs", request.costs);
  for (std::size_t k = 0; k < request.costs.size(); ++k) {
    keep.costs.push_back(ResolveCost(system, Place("costs", k), request.costs[k]));
  }
  keep.derivative = ResolveOptions(setup.derivative_options, request.derivative_options);
  return keep;
}

std::vector<HistogramAxis> ResolveHistograms(const std::vector<EnsembleBins>& asked,
                                             const std::vector<std::string>& observables) {
  CheckCount("histograms", asked);
  std::vector<HistogramAxis> axes;
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const std::string field = Place("histograms", k);
    const int observable =
        NameIndex(field + ".observable", "observable", asked[k].observable, observables);
    if (asked[k].bins < 1 || asked[k].bins > kMaxBins || !(asked[k].low < asked[k].high)) {
      throw std::invalid_argument(field + " needs low < high and 1 to " + std::to_string(kMaxBins) +
                                  " bins");
    }
    axes.push_back({observable, asked[k].low, asked[k].high, static_cast<int>(asked[k].bins)});
  }
  return axes;
}

std::uint64_t ResolveRuns(const EnsembleRequest& request, const Draws& draws) {
  const Sampler sampler(draws);
  if (request.runs == 0 && sampler.IsRandom()) {
    throw std::invalid_argument(
        "runs is 0: how many? Random numbers are drawn for as many as are asked for");
  }
  const std::uint64_t runs = request.runs == 0 ? sampler.period() : request.runs;
  if (runs <= kMaxRuns) return runs;
  throw std::invalid_argument("runs is " + std::to_string(runs) + ", expected at most " +
                              std::to_string(kMaxRuns));
}

}  // namespace

SweepRequest ResolveEnsemble(const Setup& setup, const EnsembleRequest& request) {
  const ResolvedRun run = ResolveRun(setup, request);
  SweepRequest sweep;
  // It is the setup's, which outlives the request.
  sweep.system =
      std::shared_ptr<const MechanicalSystem>(std::shared_ptr<void>(), setup.system.get());
  sweep.make = [&setup](const ParameterValues& changed) {
    ParameterValues values = setup.configuration.parameters;
    for (const auto& [name, value] : changed) values[name] = value;
    return setup.WithParameters(values);
  };
  sweep.x = run.x;
  sweep.inputs = run.input;
  sweep.duration = run.duration;
  sweep.options = run.options;
  sweep.options.max_seconds = kMaxSeconds;
  sweep.options.cancelled = nullptr;  // the sweep is asked, not a run
  CheckCount("draws", request.draws);
  sweep.draws.seed = request.seed;
  sweep.draws.sobol = request.sobol;
  for (std::size_t k = 0; k < request.draws.size(); ++k) {
    sweep.draws.parts.push_back(ResolveDraw(Place("draws", k), request.draws[k]));
  }
  sweep.count = ResolveRuns(request, sweep.draws);
  sweep.keep = ResolveKeep(setup, request);
  sweep.histograms =
      ResolveHistograms(request.histograms, ObservableNames(*setup.system, sweep.keep));
  if (request.threads > kMaxEnsembleThreads) {
    throw std::invalid_argument("threads is " + std::to_string(request.threads) +
                                ", expected at most " + std::to_string(kMaxEnsembleThreads));
  }
  sweep.threads = static_cast<int>(std::max(request.threads, std::uint32_t{1}));
  sweep.max_megabytes = run.options.max_megabytes;
  return sweep;
}

std::vector<double> ResolveProbabilities(const EnsembleRequest& request) {
  if (request.probabilities.empty()) return {0.05, 0.25, 0.5, 0.75, 0.95};
  CheckCount("probabilities", request.probabilities);
  for (std::size_t k = 0; k < request.probabilities.size(); ++k) {
    CheckWithin(Place("probabilities", k), request.probabilities[k], 0, 1);
  }
  return request.probabilities;
}

}  // namespace ros_interface
}  // namespace contact_flow
