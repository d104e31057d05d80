// SPDX-License-Identifier: BSD-3-Clause
#include "tangent_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/piecewise_linear/section.h"
#include "src/dynamics/guard_gradients.h"

namespace contact_flow {
namespace {

std::string Sentence(const MechanicalSystem& system, const WantedEvent& event,
                     const std::string& what) {
  return EventName(system, event) + " " + what;
}

/// −Dλ_i / (dλ_i/dt) in the mode before.
Eigen::RowVectorXd ReleaseRow(const MechanicalSystem& system, const Transition& transition,
                              const Vector& u, const WantedEvent& event,
                              const Variables& variables) {
  if (!transition.activated.Empty() || !transition.vanishing.Contains(event.constraint)) {
    throw std::domain_error(Sentence(system, event,
                                     "happens at an impact: its time has no derivative "
                                     "of its own"));
  }
  ContactDynamics dynamics(system, u, variables);
  const Vector& x = transition.x_minus;
  const ContactMode mode = transition.mode_before;
  const double rate = Guards(system).At(event.constraint, &dynamics, x, mode).rate;
  return -GuardGradients(&dynamics, x, mode).At(event.constraint).gradient / rate;
}

/// The pieces of B_k on (w, s), s of `count` times so far, with rows for the events
/// at transition k.
PiecewiseLinearMap WithTimes(const EventMap& map, int k, const std::vector<EventPlace>& events,
                             int count, const MechanicalSystem& system, const Trajectory& run,
                             const BDerivativeOptions& options) {
  const int most = options.max_activations_for_pieces;
  const PiecewiseLinearMap carried = WithIdentity(map.Pieces(most), count);
  std::vector<LinearPiece> pieces = carried.pieces();
  const int n = carried.rows() - count;
  std::vector<PieceTimes> times;
  for (std::size_t e = 0; e < events.size(); ++e) {
    if (events[e].transition != k) continue;
    if (times.empty()) times = map.TimesOfPieces(most);
    const int i = events[e].event.constraint;
    // With friction a piece lists ends of slip, too, and releases of what never slips alone.
    const bool listed = !events[e].event.release || !system.HasFriction() ||
                        std::isinf(system.friction()[i].coefficient);
    for (std::size_t piece = 0; piece < pieces.size(); ++piece) {
      const std::vector<int>& order = times.at(piece).constraints;
      const auto place = std::find(order.begin(), order.end(), i);
      pieces[piece].matrix.row(n + static_cast<int>(e)).head(n) =
          listed && place != order.end()
              ? Eigen::RowVectorXd(times[piece].times.row(place - order.begin()))
              : ReleaseRow(system, run.transitions[k], run.arcs[k].u, events[e].event,
                           options.variables);
    }
  }
  return PiecewiseLinearMap(std::move(pieces));
}

}  // namespace

bool Happens(const Transition& transition, const WantedEvent& event) {
  const int i = event.constraint;
  if (!transition.switched.Contains(i)) {
    return (event.release ? transition.released : transition.activated).Contains(i);
  }
  return event.release == transition.mode_before.Contains(i);
}

std::string EventName(const MechanicalSystem& system, const WantedEvent& event) {
  return std::string(event.release ? "lift-off" : "touchdown") + " number " +
         std::to_string(event.occurrence) + " of '" +
         system.description().constraints[event.constraint] + "'";
}

std::vector<EventPlace> LocateEvents(const Trajectory& run,
                                     const std::vector<WantedEvent>& events) {
  std::vector<EventPlace> located;
  for (const WantedEvent& event : events) {
    EventPlace place{-1, event};
    int left = event.occurrence;
    for (std::size_t k = 0; k < run.transitions.size() && left > 0; ++k) {
      if (Happens(run.transitions[k], event) && --left == 0) place.transition = static_cast<int>(k);
    }
    located.push_back(place);
  }
  return located;
}

Vector EventTimes(const Trajectory& run, const std::vector<EventPlace>& events) {
  Vector times = Vector::Constant(events.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t e = 0; e < events.size(); ++e) {
    if (events[e].transition >= 0) times(e) = run.transitions[events[e].transition].t;
  }
  return times;
}

PiecewiseLinearMap TangentMap(const BDerivative& B, const PiecewiseLinearMap& first,
                              const std::vector<EventPlace>& events, const MechanicalSystem& system,
                              const Trajectory& run) {
  const std::size_t limit = B.options.max_pieces;
  const int n = static_cast<int>(B.arcs.front().cols()), count = static_cast<int>(events.size());
  for (const EventPlace& event : events) {
    if (event.transition < 0)
      throw std::domain_error(Sentence(system, event.event, "does not happen"));
    if (event.transition >= static_cast<int>(B.events.size())) {
      throw std::domain_error(Sentence(system, event.event, "is the return itself"));
    }
  }
  Matrix untimed = Matrix::Zero(n, n + count);
  untimed.leftCols(n).setIdentity();
  PiecewiseLinearMap map = InBases(first, untimed, Matrix::Identity(n, n));
  for (std::size_t k = 0; k < B.events.size(); ++k) {
    map = WithTimes(B.events[k], static_cast<int>(k), events, count, system, run, B.options)
              .After(map, limit);
    map = WithIdentity(PiecewiseLinearMap::Linear(B.arcs[k + 1]), count).After(map, limit);
  }
  return map;
}

PiecewiseLinearMap WithIdentity(const PiecewiseLinearMap& map, int more) {
  if (more == 0) return map;
  std::vector<LinearPiece> pieces = map.pieces();
  for (LinearPiece& piece : pieces) {
    const Eigen::Index r = piece.matrix.rows(), c = piece.matrix.cols(), h = piece.cone.rows();
    Matrix larger = Matrix::Zero(r + more, c + more);
    larger.topLeftCorner(r, c) = piece.matrix;
    larger.bottomRightCorner(more, more).setIdentity();
    piece.matrix = larger;
    Matrix cone = Matrix::Zero(h, c + more);
    cone.leftCols(c) = piece.cone;
    piece.cone = cone;
  }
  return PiecewiseLinearMap(std::move(pieces));
}

Vector GapGradient(const MechanicalSystem& system, const VectorRef& x, int i,
                   const Variables& variables) {
  const int d = system.dof(), nq = system.num_positions(), k = variables.Size(system);
  const int parameters = static_cast<int>(variables.parameters.size());
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  Vector gradient = Vector::Zero(2 * d + k);
  gradient.head(d) = terms.jacobian.row(i).transpose();
  if (parameters > 0) {
    ParameterJacobian by_parameter;
    system.DifferentiateImpactByParameters(x.head(nq), Vector::Zero(d),
                                           Vector::Zero(terms.gap.size()), x.tail(d),
                                           variables.parameters, &by_parameter);
    gradient.tail(parameters) = by_parameter.gap.row(i).transpose();
  }
  return gradient;
}

}  // namespace contact_flow
