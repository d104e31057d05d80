// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/samples.h"

#include <algorithm>
#include <limits>
#include <ostream>
#include <string>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

/// Rows between two questions to the budget.
constexpr int kAskEvery = 8192;

/// The time that a run has used up leaves its samples to be taken; a caller who cancels does not
/// wait for them.
void AskCaller() {
  try {
    AskBudget();
  } catch (const BudgetExceeded& reason) {
    if (reason.end() != BudgetEnd::kSeconds) throw;
  }
}

/// The times of `count` that are spread evenly over [begin, end] and lie inside the arc, in order.
std::vector<double> TimesInside(const Arc& arc, double begin, double end, int count) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {
    if (i % kAskEvery == kAskEvery - 1) AskCaller();
    const double t = begin + (end - begin) * i / (count - 1.0);
    if (t > arc.t_begin && t < arc.t_end) times.push_back(t);
  }
  return times;
}

/// A field of a line: in quotes where commas, quotes or ends of lines are in it (RFC 4180).
std::string Field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + "\"";
}

/// That of velocity i: its coordinate's by the second, or of what turns where a quaternion does.
std::string RateUnit(const SystemDescription& description, std::size_t i) {
  const std::vector<std::string>& names = description.coordinates;
  const auto at = std::find(names.begin(), names.end(), description.velocities[i]);
  if (at == names.end()) return "rad/s";
  const std::string& unit = description.units[static_cast<std::size_t>(at - names.begin())];
  return (unit.empty() ? "1" : unit) + "/s";
}

}  // namespace

Samples SampleTrajectory(const Trajectory& trajectory, int count) {
  Samples samples;
  std::vector<Vector> rows;
  const double begin = trajectory.t_begin();
  const double end = trajectory.t_end();
  const auto add = [&](double t, const Vector& x) {
    if (rows.size() % kAskEvery == kAskEvery - 1) AskCaller();
    samples.t.push_back(t);
    rows.push_back(x);
  };
  for (const Arc& arc : trajectory.arcs) {
    samples.first_of_arc.push_back(static_cast<int>(rows.size()));
    add(arc.t_begin, arc.x_begin);
    if (count > 1 && !arc.dense.Empty()) {
      Vector x(arc.x_begin.size());
      for (double t : TimesInside(arc, begin, end, count)) {
        arc.dense.Evaluate(t, x.data());
        add(t, x);
      }
    }
    add(arc.t_end, arc.x_end);
  }
  samples.first_of_arc.push_back(static_cast<int>(rows.size()));
  samples.x.resize(static_cast<Eigen::Index>(rows.size()), trajectory.FinalState().size());
  for (std::size_t i = 0; i < rows.size(); ++i) samples.x.row(static_cast<int>(i)) = rows[i];
  return samples;
}

void WriteCsv(const SystemDescription& description, const Trajectory& trajectory, int count,
              std::ostream* out) {
  const Samples samples = SampleTrajectory(trajectory, count);
  *out << "t [s],mode";
  for (std::size_t i = 0; i < description.coordinates.size(); ++i) {
    *out << "," << Field(description.coordinates[i] + " [" + description.units[i] + "]");
  }
  for (std::size_t i = 0; i < description.velocities.size(); ++i) {
    const std::string unit = RateUnit(description, i);
    *out << "," << Field("d/dt " + description.velocities[i] + " [" + unit + "]");
  }
  *out << "\n";
  const std::streamsize precision = out->precision(std::numeric_limits<double>::max_digits10);
  for (std::size_t k = 0; k < trajectory.arcs.size(); ++k) {
    const std::string mode = Field(trajectory.arcs[k].mode.ToString(description.constraints));
    for (int row = samples.first_of_arc[k]; row < samples.first_of_arc[k + 1]; ++row) {
      if (row % kAskEvery == kAskEvery - 1) AskCaller();
      *out << samples.t[static_cast<std::size_t>(row)] << "," << mode;
      for (Eigen::Index j = 0; j < samples.x.cols(); ++j) *out << "," << samples.x(row, j);
      *out << "\n";
    }
  }
  out->precision(precision);
}

}  // namespace contact_flow
