// SPDX-License-Identifier: BSD-3-Clause
// The piece of an event map around one direction.
#include "contact_flow/derivative/event_map.h"
#include "frictional_event.h"

namespace contact_flow {

bool EventMap::HasOnePiece() const {
  if (absorbed_) return true;
  if (!friction_) return num_activations() < 2 && PiecewiseLinear(activated_).ok();
  // A path without decisions may still not be every direction's: some may not be decided.
  return transition_.changes_input && later_.empty() && transition_.guards.empty() &&
         transition_.activated.Empty() && transition_.mode_before == transition_.mode_after;
}

EventPiece EventMap::PieceAlong(const VectorRef& w) const {
  EventPiece piece;
  const Eigen::Index c = absorbed_ ? 0 : num_input_changes();
  if (absorbed_) {
    piece.matrix = Matrix::Identity(width(), width());
    piece.by_instants.resize(width(), 0);
    piece.times.resize(0, width());
    piece.times_by_instants.resize(0, 0);
    return piece;
  }
  if (friction_) {
    FrictionalPath path = friction_->Follow(w);
    piece.matrix = std::move(path.matrix);
    piece.by_instants = std::move(path.by_instants);
    piece.order = std::move(path.guards);
    piece.times = std::move(path.times);
    piece.times_by_instants = std::move(path.times_by_instants);
    piece.modes = std::move(path.modes);
    piece.velocities = std::move(path.velocities);
    const ContactDynamics* dynamics = dynamics_.get();
    for (int i : piece.order) {
      if (IsInputChange(i)) dynamics = later_[i - system_->num_constraints()].get();
      piece.inputs.push_back(dynamics->u());
    }
    return piece;
  }
  piece.order = activated_;
  if (num_activations() > 1 && !w.isZero(0)) {
    piece.order.clear();
    for (const PerturbedEvent& event : PerturbedEvents(w)) {
      const bool counts = event.kind == PerturbedEvent::Kind::kActivation ||
                          event.kind == PerturbedEvent::Kind::kInput;
      if (counts) piece.order.push_back(event.constraint);
    }
  }
  const Status linear = PiecewiseLinear(piece.order);
  if (!linear.ok()) throw NotPiecewiseLinear(linear.message);
  const Matrix product = WideSelection(piece.order), times = WideTimes(piece.order);
  piece.matrix = product.topLeftCorner(width(), width());
  piece.by_instants = -product.topRightCorner(width(), c);
  piece.times = times.leftCols(width());
  piece.times_by_instants = -times.rightCols(c);
  piece.modes = Modes(piece.order);
  ConstraintSet S;
  for (int i : piece.order) {
    S.Insert(i);
    piece.velocities.push_back(InstantAt(S).v);
    piece.inputs.push_back(DynamicsAfter(S).u());
  }
  return piece;
}

}  // namespace contact_flow
