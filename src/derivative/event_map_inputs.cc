// SPDX-License-Identifier: BSD-3-Clause
// Changes of the input as events of a cluster: h_k = t − t_k is counted in a place of its own
// behind the tangent, in which every field has the rate 1 and every reset is the identity.
#include <algorithm>

#include "contact_flow/derivative/event_map.h"

namespace contact_flow {

EventMap EventMap::AbsorbedRest() const {
  EventMap rest = *this;
  rest.absorbed_ = true;
  rest.friction_ = nullptr;
  rest.events_ = ConstraintSet();
  rest.activated_.clear();
  rest.cluster_ = ClusterReport();
  rest.piecewise_linear_ = Status();
  rest.examined_ = true;
  return rest;
}

ConstraintSet EventMap::ActivatedConstraints() const {
  return events_ & ConstraintSet::All(system_->num_constraints());
}

ConstraintSet EventMap::Remaining(ConstraintSet S) const {
  ConstraintSet remaining = events_ - S;
  bool first = true;
  for (int i : events_ - S) {
    if (!IsInputChange(i)) continue;
    if (!first) remaining.Erase(i);
    first = false;
  }
  return remaining;
}

bool EventMap::IsOrder(const std::vector<int>& order) const {
  int last = -1;
  for (int i : order) {
    if (!IsInputChange(i)) continue;
    if (i < last) return false;
    last = i;
  }
  return true;
}

ContactDynamics& EventMap::DynamicsAfter(ConstraintSet S) const {
  const int changes = (S - ConstraintSet::All(system_->num_constraints())).Size();
  return changes == 0 ? *dynamics_ : *later_[static_cast<std::size_t>(changes - 1)];
}

Vector EventMap::Widen(const VectorRef& w, const VectorRef& dt) const {
  Vector wide(w.size() + dt.size());
  wide << w, -dt;
  return wide;
}

Matrix EventMap::Widen(const Matrix& map) const {
  if (later_.empty()) return map;
  Matrix wide = Matrix::Identity(size(), size());
  wide.topLeftCorner(map.rows(), map.cols()) = map;
  return wide;
}

}  // namespace contact_flow
