// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/record.h"

#include <algorithm>
#include <boost/crc.hpp>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/ensemble/summary.h"

namespace contact_flow {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

void CheckSize(const Vector& v, Eigen::Index size, const std::string& what) {
  if (v.size() != size || !v.allFinite()) {
    throw std::invalid_argument(what + " needs " + std::to_string(size) + " finite numbers");
  }
}

}  // namespace

const std::vector<std::string>& MarginNames() {
  static const std::vector<std::string> names = {"approach_speed", "release_rate",  "gap", "force",
                                                 "event_interval", "cluster_spread"};
  return names;
}

std::string ModeWord(const std::vector<ContactMode>& modes, int num_constraints) {
  constexpr std::size_t kSum = 9;  // "~" and eight digits
  std::string word;
  boost::crc_32_type crc;
  std::size_t length = 0;
  for (const ContactMode& mode : modes) {
    const std::string letters = (length > 0 ? ">" : "") + mode.Word(num_constraints);
    length += letters.size();
    crc.process_bytes(letters.data(), letters.size());
    if (word.size() <= kMaxWord) word += letters;
  }
  if (length <= kMaxWord) return word;
  char sum[16];
  std::snprintf(sum, sizeof(sum), "~%08x", static_cast<unsigned>(crc.checksum()));
  return word.substr(0, kMaxWord - kSum) + sum;
}

std::string ModeWord(const Trajectory& trajectory, int num_constraints) {
  std::vector<ContactMode> modes;
  for (const Arc& arc : trajectory.arcs) modes.push_back(arc.mode);
  return ModeWord(modes, num_constraints);
}

Recorder::Recorder(const MechanicalSystem& system, const Keep& keep,
                   const std::vector<std::string>& drawn, double begin, double duration)
    : keep_(keep), begin_(begin) {
  const auto n = static_cast<std::size_t>(system.state_size());
  const auto tangent = static_cast<std::size_t>(2 * system.dof());
  const auto add = [&](bool wanted, const char* name, std::vector<std::size_t> shape) {
    if (!wanted) return;
    std::size_t width = 1;
    for (std::size_t size : shape) width *= size;
    layout_.push_back({name, std::move(shape), width, {}});
  };
  if (keep.events < 0 || keep.events > 1000000) {
    throw std::invalid_argument("events kept of a run: 0 to 1000000");
  }
  for (std::size_t k = 0; k < keep.samples.size(); ++k) {
    const double t = keep.samples[k] - begin;
    if (!(t >= 0 && t <= duration) || (k > 0 && !(keep.samples[k] > keep.samples[k - 1]))) {
      throw std::invalid_argument("samples must increase, within the run");
    }
  }
  for (const Vector& w : keep.directions) CheckSize(w, static_cast<int>(tangent), "a direction");
  for (const CostTerm& cost : keep.costs) {
    CheckSize(cost.target, static_cast<int>(n), "the target of a cost");
    CheckSize(cost.weight, static_cast<int>(n), "the weights of a cost");
    CheckSize(cost.effort, system.num_inputs(), "the effort weights of a cost");
    if ((cost.weight.array() < 0).any() || (cost.effort.array() < 0).any()) {
      throw std::invalid_argument("weights of a cost are not negative");
    }
  }
  add(keep.start, "start", {drawn.size()});
  add(keep.final_state, "final_state", {n});
  add(keep.end_time, "end_time", {});
  add(keep.margins, "margins", {MarginNames().size()});
  add(keep.events > 0, "event_times", {static_cast<std::size_t>(keep.events)});
  add(!keep.samples.empty(), "samples", {keep.samples.size(), n});
  add(!keep.directions.empty(), "derivative", {keep.directions.size(), tangent});
  add(keep.jacobian, "jacobian", {tangent, tangent});
  add(!keep.costs.empty(), "costs", {keep.costs.size()});
}

double Recorder::BytesPerRun() const {
  double bytes = (keep_.outcome ? 5.0 : 0.0) + (keep_.words ? kMaxWord + 1.0 : 0.0);
  for (const Columns::Real& column : layout_) bytes += 8.0 * static_cast<double>(column.width);
  return bytes + (keep_.Differentiates() ? 1.0 : 0.0);
}

Columns Recorder::Make(std::uint64_t first, std::size_t rows) const {
  Columns columns;
  columns.first = first;
  columns.rows = rows;
  if (keep_.outcome) {
    columns.outcome.assign(rows, kNotRun);
    columns.num_events.assign(rows, 0);
  }
  if (keep_.Differentiates()) columns.derivative_outcome.assign(rows, kNotRun);
  if (keep_.words) columns.words.resize(rows);
  columns.reals = layout_;
  for (Columns::Real& column : columns.reals) column.values.assign(rows * column.width, kNaN);
  return columns;
}

double* Recorder::Row(const char* name, std::size_t row, Columns* columns) const {
  for (Columns::Real& column : columns->reals) {
    if (column.name == name) return column.values.data() + row * column.width;
  }
  throw std::logic_error("no such column");
}

void Recorder::WriteStart(const VectorRef& drawn, std::size_t row, Columns* columns) const {
  if (keep_.start) std::copy_n(drawn.data(), drawn.size(), Row("start", row, columns));
}

void Recorder::WriteOutcome(int outcome, std::size_t row, Columns* columns) const {
  if (keep_.outcome) columns->outcome[row] = static_cast<std::int8_t>(outcome);
}

void Recorder::Clear(std::size_t begin, std::size_t end, Columns* columns) const {
  for (std::size_t row = begin; row < end; ++row) {
    WriteOutcome(kNotRun, row, columns);
    if (keep_.outcome) columns->num_events[row] = 0;
    if (keep_.Differentiates()) columns->derivative_outcome[row] = kNotRun;
    if (keep_.words) columns->words[row].clear();
  }
  for (Columns::Real& column : columns->reals) {
    std::fill(column.values.begin() + static_cast<std::ptrdiff_t>(begin * column.width),
              column.values.begin() + static_cast<std::ptrdiff_t>(end * column.width), kNaN);
  }
}

void Recorder::WriteEnd(const RunEnd& end, std::size_t row, Columns* columns) const {
  WriteOutcome(static_cast<int>(end.status.outcome), row, columns);
  if (keep_.outcome) {
    columns->num_events[row] = static_cast<std::int32_t>(end.event_times.size());
  }
  if (keep_.words) columns->words[row] = end.word;
  if (keep_.final_state) std::copy_n(end.x.data(), end.x.size(), Row("final_state", row, columns));
  if (keep_.end_time) *Row("end_time", row, columns) = end.t;
  if (keep_.margins) {
    const Margins& m = end.margins;
    const double values[] = {m.approach_speed, m.release_rate,   m.gap,
                             m.force,          m.event_interval, m.cluster_spread};
    std::copy(std::begin(values), std::end(values), Row("margins", row, columns));
  }
  if (keep_.events > 0) {
    double* out = Row("event_times", row, columns);
    const std::size_t kept =
        std::min(end.event_times.size(), static_cast<std::size_t>(keep_.events));
    std::copy_n(end.event_times.begin(), kept, out);
  }
  if (!keep_.costs.empty()) {
    const Vector costs = Costs(end.x, end.u);
    std::copy_n(costs.data(), costs.size(), Row("costs", row, columns));
  }
}

void Recorder::WriteMotion(const MechanicalSystem& system, const Trajectory& trajectory,
                           std::size_t row, Columns* columns) const {
  if (!keep_.samples.empty()) {
    double* out = Row("samples", row, columns);
    for (double t : keep_.samples) {
      if (t <= trajectory.t_end()) {
        const Vector sample = trajectory.State(t);
        std::copy_n(sample.data(), sample.size(), out);
      }
      out += system.state_size();
    }
  }
  if (!keep_.Differentiates()) return;
  try {
    WriteDerivative(system, trajectory, row, columns);
  } catch (const BudgetExceeded&) {
    throw;
  } catch (const std::exception&) {  // the motion is as good as it was
    columns->derivative_outcome[row] = kThrew;
  }
}

void Recorder::WriteDerivative(const MechanicalSystem& system, const Trajectory& trajectory,
                               std::size_t row, Columns* columns) const {
  const BDerivative derivative = DifferentiateOutcome(system, trajectory, keep_.derivative);
  columns->derivative_outcome[row] = static_cast<std::int8_t>(derivative.status.outcome);
  if (!derivative.status.ok()) return;
  const Eigen::Index size = 2 * system.dof();
  for (std::size_t k = 0; k < keep_.directions.size(); ++k) {
    double* out = Row("derivative", row, columns) + k * static_cast<std::size_t>(size);
    try {
      Eigen::Map<Vector>(out, size) = derivative(keep_.directions[k]);
    } catch (const BudgetExceeded&) {
      throw;
    } catch (const std::exception&) {  // this direction has none: NaN
      columns->derivative_outcome[row] = static_cast<std::int8_t>(Outcome::kNotDifferentiable);
    }
  }
  if (!keep_.jacobian) return;
  if (!derivative.IsDifferentiable()) {
    columns->derivative_outcome[row] = static_cast<std::int8_t>(Outcome::kNotDifferentiable);
    return;
  }
  double* out = Row("jacobian", row, columns);
  for (Eigen::Index k = 0; k < size; ++k) {
    const Vector column = derivative(Vector(Vector::Unit(size, k)));
    for (Eigen::Index i = 0; i < size; ++i) out[i * size + k] = column(i);
  }
}

Vector Recorder::Costs(const VectorRef& x, const VectorRef& u) const {
  Vector costs(static_cast<Eigen::Index>(keep_.costs.size()));
  for (std::size_t k = 0; k < keep_.costs.size(); ++k) {
    const CostTerm& cost = keep_.costs[k];
    costs(static_cast<Eigen::Index>(k)) =
        0.5 * cost.weight.dot((x - cost.target).cwiseAbs2()) + 0.5 * cost.effort.dot(u.cwiseAbs2());
  }
  return costs;
}

}  // namespace contact_flow
