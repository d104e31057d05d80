// SPDX-License-Identifier: BSD-3-Clause
#include "request.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace contact_flow {
namespace ros_interface {

AskedState FromMsg(const InitialState& m) {
  AskedState asked;
  asked.q = m.q;
  asked.v = m.v;
  asked.names = m.names;
  asked.positions = m.positions;
  asked.velocities = m.velocities;
  asked.project = m.project;
  return asked;
}

AskedOptions FromMsg(const SimulationOptions& m) {
  AskedOptions asked;
  asked.relative_tolerance = m.relative_tolerance;
  asked.absolute_tolerance = m.absolute_tolerance;
  asked.max_step = m.max_step;
  asked.simultaneity_tolerance = m.simultaneity_tolerance;
  asked.gap_tolerance = m.gap_tolerance;
  asked.speed_tolerance = m.speed_tolerance;
  asked.zeno_interval = m.zeno_interval;
  asked.complete_zeno = m.complete_zeno;
  asked.max_steps = m.max_steps;
  asked.max_events = m.max_events;
  asked.max_seconds = m.max_seconds;
  asked.max_megabytes = m.max_megabytes;
  asked.impact_law = m.impact_law;
  asked.method = m.method;
  return asked;
}

AskedDerivativeOptions FromMsg(const DerivativeOptions& m) {
  AskedDerivativeOptions asked;
  asked.tolerance = m.tolerance;
  asked.kink_tolerance = m.kink_tolerance;
  asked.max_activations_for_pieces = m.max_activations_for_pieces;
  asked.max_pieces = m.max_pieces;
  return asked;
}

namespace {

/// A row for each instant, a column for each input, where the matrix tells its shape.
void CheckShape(const MechanicalSystem& system, const InputGrid& grid) {
  const RowMajorMatrix& values = grid.values;
  if (values.rows == 0 && values.cols == 0) return;
  const std::size_t count = std::max<std::size_t>(1, grid.times.size());
  const auto m = static_cast<std::size_t>(system.num_inputs());
  if (values.data.empty() && (values.rows == 0 || values.cols == 0)) return;
  if (values.rows == count && values.cols == m) return;
  // Of one input, or at one instant, a row is as good as a column.
  const std::uint64_t entries = std::uint64_t{values.rows} * values.cols;
  if ((count == 1 || m == 1) && entries == count * m) return;
  throw std::invalid_argument("input_grid.values is " + std::to_string(values.rows) + " × " +
                              std::to_string(values.cols) + ", expected " + std::to_string(count) +
                              " instants × " + std::to_string(m) + " inputs");
}

}  // namespace

ResolvedRun ResolveRun(const Setup& setup, double duration, const InitialState& state,
                       const std::vector<double>& input, const InputGrid& input_grid,
                       const SimulationOptions& options) {
  CheckShape(*setup.system, input_grid);
  AskedRun asked;
  asked.duration = duration;
  asked.state = FromMsg(state);
  asked.input = input;
  asked.grid = {input_grid.times, input_grid.values.data};
  asked.options = FromMsg(options);
  return contact_flow::ResolveRun(setup, asked);
}

}  // namespace ros_interface
}  // namespace contact_flow
