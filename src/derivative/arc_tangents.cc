// SPDX-License-Identifier: BSD-3-Clause
#include "arc_tangents.h"

#include <stdexcept>

#include "cost_rate.h"
#include "propagation_verdict.h"

namespace contact_flow {

ArcTangents::ArcTangents(ContactDynamics* dynamics, const Arc& arc, double tolerance,
                         const RunCost* cost, VariationStatistics* statistics)
    : d_(dynamics->system().dof()), t_begin_(arc.t_begin), t_end_(arc.t_end) {
  if (arc.dense.Empty() && arc.t_end > arc.t_begin) {
    throw std::logic_error("differentiation needs a trajectory made with SimulateOptions::dense");
  }
  if (arc.t_begin < arc.t_end) {
    Make(dynamics, arc, tolerance, cost, statistics);
    return;
  }
  begin_.field = dynamics->Field(arc.x_begin, arc.mode).head(2 * d_);
  if (cost != nullptr) begin_.rate = RateOf(*cost, arc.t_begin, arc.x_begin, arc.u, arc.mode);
  end_ = begin_;
}

void ArcTangents::Forward(Matrix* columns) const {
  if (steps_.empty()) return;
  Matrix& w = *columns;
  if (bracket_begin_.size() > 0) w.middleRows(d_, d_) -= bracket_begin_ * w.topRows(d_);
  w = unit_.asDiagonal() * w;
  Matrix accelerations;
  for (const CollocationStep& step : steps_) {
    if (!step.Solve(w, &accelerations)) RefuseUnresolved(t_begin_);
    step.Advance(&w, accelerations);
  }
  w = unit_.cwiseInverse().asDiagonal() * w;
  if (bracket_end_.size() > 0) w.middleRows(d_, d_) += bracket_end_ * w.topRows(d_);
}

void ArcTangents::Backward(Vector* lambda) const {
  if (steps_.empty()) return;
  Vector& l = *lambda;
  if (bracket_end_.size() > 0) l.head(d_) += bracket_end_.transpose() * l.segment(d_, d_);
  l = l.cwiseQuotient(unit_);
  for (auto step = steps_.rbegin(); step != steps_.rend(); ++step) {
    if (!step->Retreat(lambda)) RefuseUnresolved(t_end_);
  }
  l = l.cwiseProduct(unit_);
  if (bracket_begin_.size() > 0) {
    l.head(d_) -= bracket_begin_.transpose() * l.segment(d_, d_);
  }
  if (by_variables_.size() > 0) l.tail(by_variables_.size()) += by_variables_;
}

}  // namespace contact_flow
