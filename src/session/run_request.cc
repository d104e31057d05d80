// SPDX-License-Identifier: BSD-3-Clause
#include "run_request.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/nearest_name.h"
#include "number_checks.h"

namespace contact_flow {
namespace {

/// `asked` unless it is 0.
void Override(const std::string& field, double asked, double* value) {
  CheckNumber(field, asked);
  if (asked < 0) RefuseNumber(field, asked, "a number > 0, or 0 for the default");
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

void CheckNames(const AskedState& state, const std::vector<std::string>& coordinates) {
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
InputSchedule ResolveGrid(const AskedGrid& grid, const Vector& u) {
  if (grid.times.empty() && grid.values.empty()) return InputSchedule::Constant(u);
  InputSchedule schedule;
  schedule.grid = grid.times.empty() ? std::vector<double>{0.0} : grid.times;
  const std::size_t count = schedule.grid.size(), m = static_cast<std::size_t>(u.size());
  if (count > kMaxIntervals) {
    throw std::invalid_argument("input_grid.times has " + std::to_string(count) +
                                " entries, at most " + std::to_string(kMaxIntervals) +
                                " are accepted");
  }
  CheckFinite("input_grid.times", schedule.grid);
  if (schedule.grid.front() != 0) RefuseNumber("input_grid.times[0]", schedule.grid.front(), "0");
  schedule.values.assign(count, u);
  const std::vector<double>& data = grid.values;
  if (data.empty()) return schedule;
  CheckFinite("input_grid.values", data);
  if (data.size() != count * m) {
    throw std::invalid_argument("input_grid.values has " + std::to_string(data.size()) +
                                " entries, expected " + std::to_string(count) + " instants × " +
                                std::to_string(m) + " inputs");
  }
  for (std::size_t k = 0; k < count; ++k) {
    schedule.values[k] = Eigen::Map<const Vector>(data.data() + k * m, u.size());
  }
  return schedule;
}

}  // namespace

SimulateOptions ResolveOptions(SimulateOptions o, const AskedOptions& asked) {
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

BDerivativeOptions ResolveOptions(BDerivativeOptions o, const AskedDerivativeOptions& asked) {
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
      RefuseNumber("alphas[" + std::to_string(i) + "]", asked[i], "a number from 1e-12 to 1000");
    }
  }
  return asked;
}

void ApplyState(const MechanicalSystem& system, const AskedState& state, Vector* x) {
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

ResolvedRun ResolveRun(const Setup& setup, const AskedRun& asked) {
  const SystemDescription& d = setup.system->description();
  ResolvedRun run;
  run.x = setup.system->nominal().x;
  run.duration = setup.system->nominal().duration;
  run.options = ResolveOptions(setup.options, asked.options);

  CheckNumber("duration", asked.duration);
  if (asked.duration < 0 || asked.duration > kMaxDuration) {
    RefuseNumber("duration", asked.duration, "0 (the nominal duration) to 1e6 seconds");
  }
  if (asked.duration > 0) run.duration = asked.duration;

  ApplyState(*setup.system, asked.state, &run.x);
  Vector u = setup.system->nominal().u;
  SetAll("input", asked.input, d.inputs, u);
  if (!asked.input.empty() && !asked.grid.values.empty()) {
    throw std::invalid_argument("input and input_grid.values are both given, expected one of them");
  }
  run.input = ResolveGrid(asked.grid, u);
  return run;
}

}  // namespace contact_flow
