// SPDX-License-Identifier: BSD-3-Clause
#include "request.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/nearest_name.h"
#include "src/ros/message/gate.h"

namespace contact_flow {
namespace ros_interface {
namespace {

[[noreturn]] void Refuse(const std::string& field, double value, const std::string& expected) {
  std::ostringstream text;
  text << field << " is " << value << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

/// `asked` unless it is 0.
void Override(const std::string& field, double asked, double* value) {
  CheckNumber(field, asked);
  if (asked < 0) Refuse(field, asked, "a number > 0, or 0 for the default");
  if (asked > 0) *value = asked;
}

template <class Integer>
void Override(const std::string& field, std::int64_t asked, std::int64_t largest, Integer* value) {
  if (asked < 0 || asked > largest) {
    throw std::invalid_argument(field + " is " + std::to_string(asked) + ", expected 1 to " +
                                std::to_string(largest) + ", or 0 for the default");
  }
  if (asked > 0) *value = static_cast<Integer>(asked);
}

/// One of an enumeration's names, in its order; empty for the default.
template <class Enumeration>
void Choose(const std::string& option, const std::string& kind, const std::string& asked,
            const std::vector<std::string>& names, Enumeration* value) {
  if (asked.empty()) return;
  const auto it = std::find(names.begin(), names.end(), asked);
  if (it == names.end()) {
    throw std::invalid_argument("options." + option + ": " + UnknownName(kind, asked, names));
  }
  *value = static_cast<Enumeration>(it - names.begin());
}

int IndexOf(const std::string& field, const std::string& name,
            const std::vector<std::string>& valid) {
  const auto it = std::find(valid.begin(), valid.end(), name);
  if (it == valid.end()) {
    throw std::invalid_argument(field + ": " + UnknownName("coordinate", name, valid));
  }
  return static_cast<int>(it - valid.begin());
}

/// Writes the numbers of one field to part of the state, unless the field was left out.
void SetAll(const std::string& field, const std::vector<double>& numbers,
            const std::vector<std::string>& names, Eigen::Ref<Vector> part) {
  if (numbers.empty()) return;
  CheckSize(field, numbers.size(), names.size(), names);
  CheckFinite(field, numbers);
  part = Eigen::Map<const Vector>(numbers.data(), part.size());
}

void SetNamed(const std::string& field, const std::vector<double>& numbers,
              const std::vector<std::string>& asked, const std::vector<std::string>& names,
              Eigen::Ref<Vector> part) {
  if (numbers.empty()) return;
  CheckSize(field, numbers.size(), asked.size(), asked);
  CheckFinite(field, numbers);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    part(IndexOf("state.names[" + std::to_string(i) + "]", asked[i], names)) = numbers[i];
  }
}

void CheckNames(const InitialState& state, const std::vector<std::string>& coordinates) {
  for (std::size_t i = 0; i < state.names.size(); ++i) {
    const std::string field = "state.names[" + std::to_string(i) + "]";
    IndexOf(field, state.names[i], coordinates);
    if (std::count(state.names.begin(), state.names.end(), state.names[i]) > 1) {
      throw std::invalid_argument(field + ": coordinate '" + state.names[i] + "' is named twice");
    }
  }
  if (!state.names.empty() && state.positions.empty() && state.velocities.empty()) {
    throw std::invalid_argument("state.names has " + std::to_string(state.names.size()) +
                                " entries, but state.positions and state.velocities are empty");
  }
}

/// `u` on every interval of the grid, unless the grid has values of its own.
InputSchedule ResolveGrid(const InputGrid& grid, const Vector& u) {
  if (grid.times.empty() && grid.values.data.empty()) return InputSchedule::Constant(u);
  InputSchedule schedule;
  schedule.grid = grid.times.empty() ? std::vector<double>{0.0} : grid.times;
  const std::size_t count = schedule.grid.size(), m = static_cast<std::size_t>(u.size());
  if (count > kMaxIntervals) {
    throw std::invalid_argument("input_grid.times has " + std::to_string(count) +
                                " entries, at most " + std::to_string(kMaxIntervals) +
                                " are accepted");
  }
  CheckFinite("input_grid.times", schedule.grid);
  if (schedule.grid.front() != 0) Refuse("input_grid.times[0]", schedule.grid.front(), "0");
  schedule.values.assign(count, u);
  const std::vector<double>& data = grid.values.data;
  if (data.empty()) return schedule;
  CheckFinite("input_grid.values.data", data);
  if (data.size() != count * m) {
    throw std::invalid_argument("input_grid.values.data has " + std::to_string(data.size()) +
                                " entries, expected " + std::to_string(count) + " instants × " +
                                std::to_string(m) + " inputs");
  }
  for (std::size_t k = 0; k < count; ++k) {
    schedule.values[k] = Eigen::Map<const Vector>(data.data() + k * m, u.size());
  }
  return schedule;
}

}  // namespace

void CheckFinite(const std::string& field, const std::vector<double>& numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    CheckNumber(field + "[" + std::to_string(i) + "]", numbers[i]);
  }
}

void CheckWeights(const std::string& field, const std::vector<double>& weights) {
  CheckFinite(field, weights);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (weights[k] >= 0) continue;
    throw std::invalid_argument(field + "[" + std::to_string(k) + "] is " +
                                std::to_string(weights[k]) + ", expected ≥ 0");
  }
}

void CheckSize(const std::string& field, std::size_t actual, std::size_t size,
               const std::vector<std::string>& names) {
  if (actual == size) return;
  std::string text =
      field + " has " + std::to_string(actual) + " entries, expected " + std::to_string(size);
  for (std::size_t i = 0; i < names.size(); ++i) text += (i ? ", " : ": ") + names[i];
  throw std::invalid_argument(text);
}

SimulateOptions ResolveOptions(SimulateOptions o, const SimulationOptions& asked) {
  Override("options.relative_tolerance", asked.relative_tolerance, &o.relative_tolerance);
  Override("options.absolute_tolerance", asked.absolute_tolerance, &o.absolute_tolerance);
  Override("options.max_step", asked.max_step, &o.max_step);
  Override("options.simultaneity_tolerance", asked.simultaneity_tolerance,
           &o.simultaneity_tolerance);
  Override("options.gap_tolerance", asked.gap_tolerance, &o.gap_tolerance);
  Override("options.speed_tolerance", asked.speed_tolerance, &o.speed_tolerance);
  Override("options.zeno_interval", asked.zeno_interval, &o.zeno_interval);
  o.complete_zeno = o.complete_zeno || asked.complete_zeno;
  Override("options.max_steps", asked.max_steps, kMaxSteps, &o.max_steps);
  Override("options.max_events", asked.max_events, kMaxEvents, &o.max_events);
  Override("options.max_seconds", asked.max_seconds, &o.max_seconds);
  Override("options.max_megabytes", asked.max_megabytes, &o.max_megabytes);
  Choose("impact_law", "impact law", asked.impact_law, ImpactLawNames(), &o.impact_law);
  Choose("method", "method", asked.method, IntegrationMethodNames(), &o.method);
  CheckOptions(o);
  return o;
}

BDerivativeOptions ResolveOptions(BDerivativeOptions o, const DerivativeOptions& asked) {
  Override("derivative_options.tolerance", asked.tolerance, &o.tolerance);
  Override("derivative_options.kink_tolerance", asked.kink_tolerance, &o.kink_tolerance);
  Override("derivative_options.max_activations_for_pieces", asked.max_activations_for_pieces, 10,
           &o.max_activations_for_pieces);
  constexpr std::uint64_t kMaxPieces = 1000000;
  Override("derivative_options.max_pieces",
           static_cast<std::int64_t>(std::min(asked.max_pieces, kMaxPieces + 1)), kMaxPieces,
           &o.max_pieces);
  CheckOptions(o);
  return o;
}

int ResolveCount(const std::string& field, std::uint32_t asked, int standard, int largest) {
  int count = standard;
  Override(field, asked, largest, &count);
  return count;
}

std::vector<double> ResolveAlphas(const std::vector<double>& asked) {
  if (asked.empty()) return {1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
  constexpr std::size_t kMaxAlphas = 32;
  if (asked.size() > kMaxAlphas) {
    throw std::invalid_argument("alphas has " + std::to_string(asked.size()) +
                                " entries, at most " + std::to_string(kMaxAlphas) +
                                " are accepted");
  }
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (!(asked[i] >= 1e-12 && asked[i] <= 1e3)) {
      Refuse("alphas[" + std::to_string(i) + "]", asked[i], "a number from 1e-12 to 1000");
    }
  }
  return asked;
}

void ApplyState(const MechanicalSystem& system, const InitialState& state, Vector* x) {
  const SystemDescription& d = system.description();
  const Eigen::Index dof = system.dof(), nq = system.num_positions();
  SetAll("state.q", state.q, d.coordinates, x->head(nq));
  SetAll("state.v", state.v, d.velocities, x->tail(dof));
  CheckNames(state,
             state.positions.empty() && !state.velocities.empty() ? d.velocities : d.coordinates);
  SetNamed("state.positions", state.positions, state.names, d.coordinates, x->head(nq));
  SetNamed("state.velocities", state.velocities, state.names, d.velocities, x->tail(dof));
  if (state.project && !ProjectState(system, x)) {
    throw std::invalid_argument("state cannot be projected on the bilateral constraints");
  }
}

void ApplyNamed(const std::string& what, const std::vector<std::string>& names,
                const std::vector<double>& values, const std::vector<std::string>& valid,
                Vector* vector) {
  CheckSize("values", values.size(), names.empty() ? valid.size() : names.size(),
            names.empty() ? valid : names);
  CheckFinite("values", values);
  for (std::size_t i = 0; i < values.size(); ++i) {
    auto it = valid.begin() + static_cast<std::ptrdiff_t>(i);
    if (!names.empty()) {
      const std::string field = "names[" + std::to_string(i) + "]: ";
      it = std::find(valid.begin(), valid.end(), names[i]);
      if (it == valid.end()) {
        throw std::invalid_argument(field + UnknownName(what, names[i], valid));
      }
      if (std::count(names.begin(), names.end(), names[i]) > 1) {
        throw std::invalid_argument(field + what + " '" + names[i] + "' is named twice");
      }
    }
    (*vector)(it - valid.begin()) = values[i];
  }
}

Run ResolveRun(const Setup& setup, double duration, const InitialState& state,
               const std::vector<double>& input, const InputGrid& input_grid,
               const SimulationOptions& options) {
  const SystemDescription& d = setup.system->description();
  Run run;
  run.x = setup.system->nominal().x;
  run.duration = setup.system->nominal().duration;
  run.options = ResolveOptions(setup.options, options);

  CheckNumber("duration", duration);
  if (duration < 0 || duration > kMaxDuration) {
    Refuse("duration", duration, "0 (the nominal duration) to 1e6 seconds");
  }
  if (duration > 0) run.duration = duration;

  ApplyState(*setup.system, state, &run.x);
  Vector u = setup.system->nominal().u;
  SetAll("input", input, d.inputs, u);
  if (!input.empty() && !input_grid.values.data.empty()) {
    throw std::invalid_argument("input and input_grid.values are both given, expected one of them");
  }
  run.input = ResolveGrid(input_grid, u);
  return run;
}

}  // namespace ros_interface
}  // namespace contact_flow
