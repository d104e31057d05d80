// SPDX-License-Identifier: BSD-3-Clause
// The B-derivative of a return that was found.
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "contact_flow/analysis/poincare.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/piecewise_linear/section.h"
#include "retraction.h"
#include "symmetry_check.h"
#include "tangent_map.h"

namespace contact_flow {
namespace {

/// A return and an event so close, relative to the time, coincide.
constexpr double kAtOnce = 1e-7;

}  // namespace

/// Tangents of the section that the contact mode admits.
Matrix PoincareMap::Basis(const VectorRef& x, ContactMode mode) const {
  const int n = 2 * system_.dof();
  // The section of what returns is the image of the one that is crossed; that of an event lies
  // where contacts touch.
  Vector gradient;
  const ReturnSymmetry& symmetry = section_.symmetry;
  Height(symmetry.Undo(system_, x), &gradient);
  if (!symmetry.Empty()) {
    gradient = (symmetry.Exchanged(system_) * gradient).eval();
    if (section_.kind == Section::Kind::kEvent) gradient.setZero();
  }
  const Matrix slice = symmetry.Slice(system_);
  const Matrix held = HeldRows(system_, x, mode, Touching(x));
  Matrix rows(n + 1 + slice.rows() + held.rows(), n);
  rows.row(n) = gradient.transpose() / std::max(gradient.norm(), 1e-300);
  if (section_.kind == Section::Kind::kTime) rows.row(n).setZero();
  rows.middleRows(n + 1, slice.rows()) = slice;
  rows.bottomRows(held.rows()) = held;
  for (int k = 0; k < n; ++k) {
    const Vector unit = Vector::Unit(n, k);
    rows.col(k).head(n) = unit - ProjectAdmissible(system_, x, mode, unit);
  }
  if (rows.isZero(0)) return Matrix::Identity(n, n);
  return NullSpace(rows);
}

/// Contacts whose gaps are zero behind an event of the section.
ConstraintSet PoincareMap::Touching(const VectorRef& x) const {
  if (section_.kind != Section::Kind::kEvent) return {};
  return TouchingAt(system_, x, options_.simulate.gap_tolerance);
}

/// Does an event lie within its simultaneity tolerance of the return, before or behind it?
bool PoincareMap::AtAnEvent(const VectorRef& x, const PoincareReturn& result) const {
  const double instant = kAtOnce * result.time;
  const auto near = [&](const std::vector<Transition>& events) {
    return std::any_of(events.begin(), events.end(), [&](const Transition& event) {
      return std::abs(result.time - event.t) <= std::max(2 * event.tolerance, instant);
    });
  };
  if (near(result.trajectory.transitions)) return true;
  // No event behind the return is known yet: those before it tell how uncertain one may be.
  SimulateOptions options = options_.simulate;
  options.dense = false;
  const double ahead = std::max(2 * result.trajectory.simultaneity_tolerance, instant);
  const Trajectory beyond = Simulate(system_, x, u_, result.time + ahead, options);
  return !beyond.status.ok() || near(beyond.transitions);
}

void PoincareMap::Differentiate(const VectorRef& x, PoincareReturn* result) const {
  const auto none = [result](const std::string& why) {
    result->status = ReturnStatus::kNoDerivative;
    result->message = why;
  };
  const Trajectory& run = result->trajectory;
  const bool event = section_.kind == Section::Kind::kEvent;
  const std::size_t last = run.arcs.size() - (event ? 2 : 1);
  const int n = 2 * system_.dof();
  try {
    if (!event && AtAnEvent(x, *result)) return none("the return coincides with an event");
    const BDerivative B = DifferentiateArcs(system_, run, 0, last, options_.derivative);
    if (!B.status.ok()) return none(B.status.message);
    if (!section_.symmetry.Empty()) {
      const std::string why =
          SymmetryObstacle(system_, u_, section_, options_, x, *result, B, last);
      if (!why.empty()) {
        none("the section's symmetry is none of the system: " + why);
        result->status = ReturnStatus::kRefused;
        return;
      }
    }
    // Directions along the section hold what the start holds. Others may not.
    const auto held = PiecewiseLinearMap::Linear(B.arcs.front());
    result->extended = Extended(B, held, *result);
    const int rows = result->extended.rows(), cols = result->extended.cols();
    const Matrix all = Matrix::Identity(cols, cols), end = Matrix::Identity(rows, rows);
    const Matrix& basis = result->start_basis;
    Matrix start = Matrix::Zero(cols, basis.cols());
    start.topRows(n) = basis;
    result->reduced =
        InBases(InBases(result->extended, end.leftCols(n), all), result->end_basis, start);
    if (!B.start.PiecewiseLinear().ok() || !B.start_stop.PiecewiseLinear().ok()) {
      Matrix part = all;  // of a direction, along the section
      part.topLeftCorner(n, n) = basis * basis.transpose();
      result->extended = InBases(result->extended, end, part);
    } else if (!B.start.Empty() || !B.start_stop.Empty()) {
      result->extended = Extended(B, B.FirstPieces(), *result);
    }
    result->map = InBases(result->extended, end.leftCols(n), all);
    result->return_time = InBases(result->extended, end.col(n), all);
  } catch (const std::length_error& limit) {
    return none(limit.what());
  } catch (const std::domain_error& missing) {
    return none(missing.what());
  }
}

/// From the tangents at the fixed time of the return, B, and the event times below them, to the
/// rows (P, time of return, event times):  (I − F ds/(ds F)) w,  −ds w/(ds F).
PiecewiseLinearMap PoincareMap::Extended(const BDerivative& B, const PiecewiseLinearMap& first,
                                         const PoincareReturn& result) const {
  const Trajectory& run = result.trajectory;
  const bool event = section_.kind == Section::Kind::kEvent;
  const Arc& arc = run.arcs[run.arcs.size() - (event ? 2 : 1)];
  const PiecewiseLinearMap tangents =
      TangentMap(B, first, LocateEvents(run, options_.events), system_, run);
  const int n = 2 * system_.dof(), size = tangents.cols();
  const int times = tangents.rows() - size;
  Matrix onto = Matrix::Zero(size + 1 + times, size + times);
  onto.topLeftCorner(size, size).setIdentity();
  onto.bottomRightCorner(times, times).setIdentity();
  if (section_.kind != Section::Kind::kTime) {
    Vector ds = Vector::Zero(size), field = Vector::Zero(size);
    if (event) {
      ds = GapGradient(system_, arc.x_end, section_.index, options_.derivative.variables);
    } else {
      Vector gradient;
      Height(run.FinalState(), &gradient);
      ds.head(n) = gradient;
    }
    field.head(n) = B.time;
    const double speed = ds.dot(field);
    onto.block(size, 0, 1, size) = -ds.transpose() / speed;
    onto.topLeftCorner(size, size) += field * onto.block(size, 0, 1, size);
  }
  PiecewiseLinearMap rows = InBases(tangents, onto.transpose(), Matrix::Identity(size, size));
  if (event) {
    rows =
        WithIdentity(ThroughEvent(result), 1 + times).After(rows, options_.derivative.max_pieces);
  }
  Matrix kept = Matrix::Zero(rows.rows(), n + 1 + times);
  kept.topLeftCorner(n, n).setIdentity();
  kept.bottomRightCorner(1 + times, 1 + times).setIdentity();
  if (!section_.symmetry.Empty()) {
    kept.topLeftCorner(n, n) = section_.symmetry.Tangent(system_).transpose();
  }
  return InBases(rows, kept, Matrix::Identity(size, size));
}

/// The first-order map of the section's event; throws std::domain_error when it is not alone.
PiecewiseLinearMap PoincareMap::ThroughEvent(const PoincareReturn& result) const {
  const Transition& event = result.trajectory.transitions.back();
  const EventMap through(
      std::make_shared<ContactDynamics>(system_, u_, options_.derivative.variables), event);
  if (!through.status().ok()) throw std::domain_error(through.status().message);
  if ((event.activated | event.switched).Size() != 1 ||
      (!system_.HasFriction() && through.num_activations() != 1)) {
    throw std::domain_error("other constraints are activated at t = " + std::to_string(event.t) +
                            " s as well");
  }
  if (RestitutionRises(event)) {
    throw std::domain_error("the restitution of '" +
                            system_.description().constraints[section_.index] +
                            "' is 0 and among the variables: at t = " + std::to_string(event.t) +
                            " s, where the section is, it would not yet rest");
  }
  return through.Pieces(1);
}

/// Whether the section's plastic contact would bounce for a change of a variable. Bounces then end
/// at once, to first order, but behind the section.
bool PoincareMap::RestitutionRises(const Transition& event) const {
  const std::vector<int>& parameters = options_.derivative.variables.parameters;
  if (parameters.empty() || system_.restitution()(section_.index) > 0) return false;
  const int d = system_.dof();
  const Vector q = event.x_minus.head(system_.num_positions()), v = event.x_minus.tail(d);
  ConstraintTerms terms;
  system_.Constraints(q, v, &terms);
  ParameterJacobian by_parameter;
  system_.DifferentiateImpactByParameters(q, Vector::Zero(d), Vector::Zero(terms.gap.size()), v,
                                          parameters, &by_parameter);
  return !by_parameter.restitution.row(section_.index).isZero(0);
}

}  // namespace contact_flow
