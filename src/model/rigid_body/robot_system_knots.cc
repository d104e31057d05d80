// SPDX-License-Identifier: BSD-3-Clause
// Where what a robot follows and stands on has knots (SplineKnots), and where that is narrow
// (NarrowSurfaces).
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "robot_scratch.h"

namespace contact_flow {
namespace {

/// A knot this near behind the clock is at it, relative to max(1, |clock|).
constexpr double kAtKnot = 1e-12;

}  // namespace

void RobotSystem::DescribeKnots() {
  for (int i = 0; i < num_constraints(); ++i) {
    if (constraint(i).IsNarrow()) narrow_.push_back(i);
    const std::vector<std::vector<double>> knots = constraint(i).Knots();
    if (knots.empty()) continue;
    placed_.push_back({i, static_cast<int>(knots_.size()), static_cast<int>(knots.size())});
    knots_.insert(knots_.end(), knots.begin(), knots.end());
  }
}

double RobotSystem::TimeToKnot(const VectorRef& q, const VectorRef& v) const {
  double next = std::numeric_limits<double>::infinity();
  if (robot_.model.clock < 0) return next;
  const RobotModel::Coordinate clock = robot_.model.ClockCoordinate();
  const double pace = v(clock.v), now = q(clock.q);
  if (!(pace > 0)) return next;
  const double behind = now + kAtKnot * std::max(1.0, std::abs(now));
  for (const auto& effort : robot_.efforts) {
    if (effort->parts.reference) next = std::min(next, effort->parts.reference->NextKnot(behind));
  }
  for (const auto& element : robot_.constraints) next = std::min(next, element->NextKnot(behind));
  return (next - now) / pace;
}

void RobotSystem::Places(const VectorRef& q, const ContactMode& mode, Vector* place) const {
  const Loan loan(this);
  Scratch* s = loan.get();
  place->setConstant(static_cast<Eigen::Index>(knots_.size()),
                     std::numeric_limits<double>::quiet_NaN());
  bool moved = false;
  for (const PlacedContact& contact : placed_) {
    if (!mode.Contains(contact.constraint)) continue;
    if (!moved) s->MoveTo(robot_.model.tree, q.data(), s->zero.data());
    moved = true;
    constraint_geometry_[static_cast<std::size_t>(contact.constraint)].Place(s->state, q.data(),
                                                                             &s->motion);
    constraint(contact.constraint).Across(s->motion.z, place->data() + contact.first);
  }
}

void RobotSystem::Passages(const VectorRef& q, const VectorRef& v,
                           std::vector<SurfacePassage>* passages) const {
  const Loan loan(this);
  Scratch* s = loan.get();
  passages->assign(static_cast<std::size_t>(num_constraints()), SurfacePassage());
  if (!narrow_.empty()) s->MoveTo(robot_.model.tree, q.data(), v.data());
  for (int i : narrow_) {
    const auto k = static_cast<std::size_t>(i);
    constraint_geometry_[k].Place(s->state, q.data(), &s->motion);
    constraint_geometry_[k].Move(s->state, v.data(), &s->motion);
    (*passages)[k] = constraint(i).Passage(s->motion.z, s->motion.rate);
  }
}

}  // namespace contact_flow
