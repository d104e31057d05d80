// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/poincare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/analysis/section.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/nearest_name.h"
#include "tangent_map.h"

namespace contact_flow {
namespace {

constexpr int kSamples = 16;       // of a step of the integrator
constexpr int kFirstHorizon = 16;  // the horizon is tried in parts: 1/16, 1/8, …
constexpr int kMaxNewton = 8;
constexpr double kSettled = 1e-15;  // relative change of the time of return

int IndexOf(const std::string& kind, const std::string& name,
            const std::vector<std::string>& valid) {
  const auto found = std::find(valid.begin(), valid.end(), name);
  if (found == valid.end()) throw std::invalid_argument(UnknownName(kind, name, valid));
  return static_cast<int>(found - valid.begin());
}

template <class... Parts>
std::string Text(const Parts&... parts) {
  std::ostringstream text;
  text.precision(9);
  (text << ... << parts);
  return text.str();
}

}  // namespace

const char* ReturnStatusName(ReturnStatus status) {
  constexpr const char* kNames[] = {"returned", "no return",     "stopped",
                                    "tangent",  "no derivative", "refused"};
  return kNames[static_cast<int>(status)];
}

Section Section::Coordinate(const MechanicalSystem& system, const std::string& name, double value,
                            int sign) {
  return {Kind::kCoordinate, IndexOf("coordinate", name, system.description().coordinates), value,
          sign};
}

Section Section::Apex(const MechanicalSystem& system, const std::string& coordinate) {
  return {Kind::kVelocity, IndexOf("velocity", coordinate, system.description().velocities), 0, -1};
}

Section Section::Event(const MechanicalSystem& system, const std::string& constraint) {
  return {Kind::kEvent, IndexOf("constraint", constraint, system.description().constraints), 0, -1};
}

Section Section::After(double seconds) { return {Kind::kTime, 0, seconds, 0}; }

PoincareMap::PoincareMap(const MechanicalSystem& system, const VectorRef& u, const Section& section,
                         const PoincareOptions& options)
    : system_(system), u_(u), section_(section), options_(options) {
  const int sizes[] = {system.num_positions(), system.dof(), system.num_constraints(), 1};
  if (section.index < 0 || section.index >= sizes[static_cast<int>(section.kind)]) {
    throw std::invalid_argument(Text("section: there is no number ", section.index, " of its kind"));
  }
  if (section.kind == Section::Kind::kTime && !(section.value > 0)) {
    throw std::invalid_argument(Text("section: ", section.value, " s is no period"));
  }
  if (!(options.horizon > 0) || !std::isfinite(options.horizon) || !(options.shortest >= 0)) {
    throw std::invalid_argument(Text("horizon = ", options.horizon, " s and shortest = ",
                                     options.shortest, " s must be positive"));
  }
}

double PoincareMap::Height(const VectorRef& x, Vector* gradient) const {
  const int d = system_.dof(), nq = system_.num_positions(), i = section_.index;
  *gradient = Vector::Zero(2 * d);
  switch (section_.kind) {
    case Section::Kind::kCoordinate: {
      Vector rate(nq);
      const Vector q = x.head(nq);
      for (int k = 0; k < d; ++k) {
        const Vector unit = Vector::Unit(d, k);
        system_.space().Rate(q.data(), unit.data(), rate.data());
        (*gradient)(k) = rate(i);
      }
      return x(i) - section_.value;
    }
    case Section::Kind::kVelocity:
      (*gradient)(d + i) = 1;
      return x(nq + i) - section_.value;
    case Section::Kind::kEvent: {
      ConstraintTerms terms;
      system_.Constraints(x.head(nq), x.tail(d), &terms);
      gradient->head(d) = terms.jacobian.row(i).transpose();
      return terms.gap(i);
    }
    case Section::Kind::kTime:
      break;
  }
  return 0;
}

PoincareReturn PoincareMap::Return(const VectorRef& x, bool differentiate) const {
  PoincareReturn result;
  try {
    if (section_.kind == Section::Kind::kTime) {
      result.time = section_.value;
      Settle(x, &result);
    } else {
      result.message = Text("the section was not crossed within ", options_.horizon, " s");
      double part = options_.horizon / kFirstHorizon;
      while (!FindReturn(x, part, &result) && result.status == ReturnStatus::kNoReturn &&
             part < options_.horizon) {
        part = std::min(2 * part, options_.horizon);
      }
    }
  } catch (const std::invalid_argument& refusal) {
    result.status = ReturnStatus::kRefused;
    result.message = refusal.what();
  }
  if (result.status != ReturnStatus::kReturned || !differentiate) return result;
  result.start_basis = Basis(x, result.trajectory.arcs.front().mode);
  result.end_basis = Basis(result.x, result.trajectory.arcs.back().mode);
  Differentiate(x, &result);
  return result;
}

/// Looks for the return in a run of that duration; true when there is one.
bool PoincareMap::FindReturn(const VectorRef& x, double duration, PoincareReturn* result) const {
  SimulateOptions options = options_.simulate;
  options.dense = true;
  Trajectory run = Simulate(system_, x, u_, duration, options);
  bool found = false;
  if (section_.kind == Section::Kind::kEvent) {
    const Status status = run.status;
    found = FindEvent(x, std::move(run), result);
    if (!found && !status.ok()) {
      result->status = ReturnStatus::kStopped;
      result->message = status.message;
    }
    return found;
  }
  found = FindCrossing(run, &result->time);
  if (found) {
    Settle(x, result);
  } else if (!run.status.ok()) {
    result->status = ReturnStatus::kStopped;
    result->message = run.status.message;
    result->trajectory = std::move(run);
  }
  return found;
}

/// The first crossing of a state section, to the accuracy of the dense output.
bool PoincareMap::FindCrossing(const Trajectory& run, double* time) const {
  Vector x(system_.state_size()), gradient;
  for (const Arc& arc : run.arcs) {
    const auto height = [&](double t) {
      arc.dense.Evaluate(t, x.data());
      return Height(x, &gradient);
    };
    bool known = false;
    double before = 0, t_before = 0;
    for (std::size_t k = 0; k < arc.dense.NumSteps(); ++k) {
      for (int sample = 0; sample <= kSamples; ++sample) {
        const double t = std::min(
            arc.t_end, arc.dense.StepBegin(k) + arc.dense.StepLength(k) * sample / kSamples);
        if (t < options_.shortest) continue;
        const double now = height(t);
        const bool rises = known && before < 0 && now >= 0 && section_.sign >= 0;
        const bool falls = known && before > 0 && now <= 0 && section_.sign <= 0;
        if (rises || falls) {
          double low = t_before, high = t;
          for (int halving = 0; halving < 60 && high - low > 1e-16 * high; ++halving) {
            const double middle = 0.5 * (low + high);
            (rises == (height(middle) < 0) ? low : high) = middle;
          }
          *time = 0.5 * (low + high);
          return true;
        }
        known = true;
        before = now;
        t_before = t;
      }
    }
  }
  return false;
}

/// Newton's method for the time of return, each step a run that ends there.
void PoincareMap::Settle(const VectorRef& x, PoincareReturn* result) const {
  SimulateOptions options = options_.simulate;
  options.dense = true;
  ContactDynamics dynamics(system_, u_);
  for (int k = 0; k < kMaxNewton; ++k) {
    result->trajectory = Simulate(system_, x, u_, result->time, options);
    if (!result->trajectory.status.ok()) {
      result->status = ReturnStatus::kStopped;
      result->message = result->trajectory.status.message;
      return;
    }
    result->x = result->trajectory.FinalState();
    if (section_.kind == Section::Kind::kTime) break;
    Vector gradient;
    const double height = Height(result->x, &gradient);
    const Vector field = dynamics.Field(result->x, result->trajectory.arcs.back().mode);
    result->crossing_speed = gradient.dot(field);
    if (!(std::abs(result->crossing_speed) > options.speed_tolerance)) {
      result->status = ReturnStatus::kTangent;
      result->message = Text("the section is touched at t = ", result->time, " s: ds F = ",
                             result->crossing_speed);
      return;
    }
    const double change = -height / result->crossing_speed;
    if (std::abs(change) <= kSettled * std::max(1.0, result->time)) break;
    if (k + 1 < kMaxNewton) result->time += change;
  }
  result->status = ReturnStatus::kReturned;
  result->message.clear();
}

/// The first activation of the section's constraint; cuts the run there.
bool PoincareMap::FindEvent(const VectorRef& x, Trajectory run, PoincareReturn* result) const {
  std::size_t k = 0;
  while (k < run.transitions.size() &&
         !(run.transitions[k].activated.Contains(section_.index) &&
           run.transitions[k].t >= options_.shortest)) {
    ++k;
  }
  // Behind the event there is an arc, unless the run ended at it.
  if (k >= run.transitions.size() || k + 1 >= run.arcs.size()) return false;
  run.transitions.resize(k + 1);
  run.arcs.resize(k + 2);
  const Transition& event = run.transitions.back();
  Arc& last = run.arcs.back();
  last.t_end = last.t_begin;
  last.x_end = last.x_begin;
  last.dense = DenseArc();
  result->time = event.t;
  result->x = event.x_plus;
  Vector gradient;
  Height(event.x_minus, &gradient);
  result->crossing_speed = gradient.head(system_.dof()).dot(event.x_minus.tail(system_.dof()));
  // Margins of what has happened so far.
  SimulateOptions options = options_.simulate;
  const double shorter = event.t - options.simultaneity_tolerance;
  run.status = {};
  if (shorter > 0) run.margins = Simulate(system_, x, u_, shorter, options).margins;
  run.margins.approach_speed =
      std::min(run.margins.approach_speed, std::abs(result->crossing_speed));
  run.margins.cluster_spread = std::max(run.margins.cluster_spread, event.spread);
  result->trajectory = std::move(run);
  result->status = ReturnStatus::kReturned;
  result->message.clear();
  return true;
}

/// Tangents of the section that the contact mode admits.
Matrix PoincareMap::Basis(const VectorRef& x, ContactMode mode) const {
  const int n = 2 * system_.dof();
  Matrix rows(n + 1, n);
  Vector gradient;
  Height(x, &gradient);
  rows.row(n) = gradient.transpose() / std::max(gradient.norm(), 1e-300);
  if (section_.kind == Section::Kind::kTime) rows.row(n).setZero();
  for (int k = 0; k < n; ++k) {
    const Vector unit = Vector::Unit(n, k);
    rows.col(k).head(n) = unit - ProjectAdmissible(system_, x, mode, unit);
  }
  if (rows.isZero(0)) return Matrix::Identity(n, n);
  return NullSpace(rows);
}

/// Does an event lie within the simultaneity tolerance of the return, before or behind it?
bool PoincareMap::AtAnEvent(const VectorRef& x, const PoincareReturn& result) const {
  const std::vector<Transition>& events = result.trajectory.transitions;
  const double tolerance = 2 * options_.simulate.simultaneity_tolerance;
  if (!events.empty() && result.time - events.back().t <= tolerance) return true;
  SimulateOptions options = options_.simulate;
  options.dense = false;
  const Trajectory beyond = Simulate(system_, x, u_, result.time + tolerance, options);
  return !beyond.status.ok() || beyond.transitions.size() != events.size();
}

void PoincareMap::Differentiate(const VectorRef& x, PoincareReturn* result) const {
  const auto none = [result](const std::string& why) {
    result->status = ReturnStatus::kNoDerivative;
    result->message = why;
  };
  const Trajectory& run = result->trajectory;
  const bool event = section_.kind == Section::Kind::kEvent;
  const std::size_t last = run.arcs.size() - (event ? 2 : 1);
  try {
    if (!event && AtAnEvent(x, *result)) return none("the return coincides with an event");
    const BDerivative B = DifferentiateArcs(system_, run, 0, last, options_.derivative);
    if (!B.status.ok()) return none(B.status.message);
    const PiecewiseLinearMap tangents = TangentMap(B);
    const int n = 2 * system_.dof(), size = tangents.cols();
    if (event) {
      ThroughEvent(tangents, result);
    } else if (section_.kind == Section::Kind::kTime) {
      result->map = InBases(tangents, Matrix::Identity(size, n), Matrix::Identity(size, size));
      result->return_time = PiecewiseLinearMap::Linear(Matrix::Zero(1, size));
    } else {
      Vector gradient, ds = Vector::Zero(size), field = Vector::Zero(size);
      Height(result->x, &gradient);
      ds.head(n) = gradient;
      field.head(n) = B.time;
      result->return_time = CrossingTime(tangents, ds, field);
      result->map = InBases(OntoSection(tangents, ds, field), Matrix::Identity(size, n),
                            Matrix::Identity(size, size));
    }
  } catch (const std::length_error& limit) {
    return none(limit.what());
  }
  if (result->status != ReturnStatus::kReturned) return;
  Matrix start = Matrix::Zero(result->map.cols(), result->start_basis.cols());
  start.topRows(result->start_basis.rows()) = result->start_basis;
  result->reduced = InBases(result->map, result->end_basis, start);
}

/// Tangents w at the fixed time of the event, moved to where a_i = 0, are mapped to its right limit.
void PoincareMap::ThroughEvent(const PiecewiseLinearMap& before, PoincareReturn* result) const {
  const Transition& event = result->trajectory.transitions.back();
  const Arc& arc = result->trajectory.arcs[result->trajectory.arcs.size() - 2];
  const auto dynamics =
      std::make_shared<ContactDynamics>(system_, u_, options_.derivative.variables);
  const EventMap through(dynamics, event);
  if (!through.status().ok() || through.num_activations() != 1) {
    result->status = ReturnStatus::kNoDerivative;
    result->message = through.status().ok()
                          ? Text("other constraints are activated at t = ", event.t, " s as well")
                          : through.status().message;
    return;
  }
  const int n = 2 * system_.dof(), size = before.cols();
  const Vector ds = GapGradient(system_, event.x_minus, section_.index, options_.derivative.variables);
  const Vector field = dynamics->Field(event.x_minus, arc.mode);
  result->return_time = CrossingTime(before, ds, field);
  const PiecewiseLinearMap after =
      through.Pieces(1).After(OntoSection(before, ds, field), options_.derivative.max_pieces);
  result->map = InBases(after, Matrix::Identity(size, n), Matrix::Identity(size, size));
}

}  // namespace contact_flow
