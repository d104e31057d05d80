// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/online_flow.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

/// What has been begun at an event is finished: a flow stops between its steps only.
const Budget& Unlimited() {
  static const Budget unlimited;
  return unlimited;
}

SimulateOptions WithoutBudgets(SimulateOptions options) {
  Validate(options);
  options.max_steps = options.max_events = std::numeric_limits<long>::max();
  options.max_seconds = std::numeric_limits<double>::infinity();
  return options;
}

}  // namespace

OnlineFlow::OnlineFlow(std::shared_ptr<const MechanicalSystem> system, double t, const VectorRef& x,
                       const VectorRef& u, const SimulateOptions& options)
    : system_(std::move(system)),
      flow_(*system_, t, x, InitialMode(*system_, x, u, options), u, WithoutBudgets(options)),
      now_(t) {
  BeginMotion();
}

bool OnlineFlow::Propose() {
  if (!proposed_) proposed_ = flow_.Propose();
  return proposed_;
}

bool OnlineFlow::Accept(double end) {
  if (keep_ && flow_.proposed_length() > 0) {
    motion_.dense.Append(flow_.t(), flow_.proposed_length(), flow_.ProposedDense(),
                         system_->state_size());
  }
  proposed_ = false;
  if (flow_.proposed_end() > end) {
    flow_.Cut(end);
    motion_.t_end = flow_.t();
    motion_.x_end = flow_.x();
    return false;
  }
  motion_.t_end = flow_.proposed_end();
  motion_.x_end = flow_.proposed_state();
  const BudgetScope whole(Unlimited());
  return flow_.Accept();
}

bool OnlineFlow::AdvanceTo(double t) {
  if (!(t >= now_)) {
    std::ostringstream message;
    message.precision(17);
    message << "an online run at " << now_ << " s cannot go back to " << t << " s";
    throw std::invalid_argument(message.str());
  }
  if (arc_ended_) BeginMotion();
  try {
    return Advance(t);
  } catch (...) {  // a budget has ended: what was accepted stays
    now_ = std::max(now_, flow_.t());
    throw;
  }
}

bool OnlineFlow::Advance(double t) {
  while (flow_.status().ok()) {
    // What is told for t itself may still be told anew: an input changes when now() goes
    // beyond its time.
    const bool changes = !inputs_.empty() && inputs_.front().t < t;
    const double stop = changes ? inputs_.front().t : t;
    bool passed = false;
    if (flow_.t() < stop) {
      if (!Propose()) break;
      if (flow_.proposed_end() > stop && !changes) break;
      passed = Accept(stop);
    } else if (changes) {
      proposed_ = false;
      const BudgetScope whole(Unlimited());
      passed = flow_.EndSlips();
      if (!passed && flow_.status().ok()) {
        const Input input = std::move(inputs_.front());
        inputs_.pop_front();
        passed = flow_.ChangeInput(input.u);
      }
    } else {
      break;
    }
    if (passed) {
      arc_ended_ = true;
      now_ = std::max(now_, flow_.t());
      return true;
    }
  }
  now_ = flow_.status().ok() ? t : std::max(now_, flow_.t());
  return false;
}

void OnlineFlow::Settle() {
  if (flow_.t() < now_ && Propose()) Accept(now_);
}

void OnlineFlow::SetInput(double t, const VectorRef& u) {
  std::ostringstream message;
  message.precision(17);
  if (!(t >= now_) || !std::isfinite(t)) {
    message << "the time of the input is " << t << " s: it must be finite and not before " << now_
            << " s";
    throw std::invalid_argument(message.str());
  }
  if (u.size() != system_->num_inputs()) {
    message << "the input u has " << u.size() << " entries: " << system_->num_inputs()
            << " are needed";
    throw std::invalid_argument(message.str());
  }
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    if (std::isfinite(u(i))) continue;
    message << "input '" << system_->description().inputs[i] << "' is " << u(i)
            << ": it must be finite";
    throw std::invalid_argument(message.str());
  }
  const auto place = std::lower_bound(inputs_.begin(), inputs_.end(), t,
                                      [](const Input& input, double s) { return input.t < s; });
  if (place != inputs_.end() && place->t == t) {
    place->u = u;
  } else {
    inputs_.insert(place, {t, u});
  }
}

const Vector& OnlineFlow::NextInput() const {
  return !inputs_.empty() && inputs_.front().t <= now_ ? inputs_.front().u : flow_.u();
}

Vector OnlineFlow::State() {
  Vector x = flow_.x();
  if (now_ > flow_.t() && flow_.status().ok() && Propose() && flow_.proposed_length() > 0) {
    const double theta = std::clamp((now_ - flow_.t()) / flow_.proposed_length(), 0.0, 1.0);
    EvaluateDenseStep(flow_.ProposedDense(), system_->state_size(), theta, x.data());
  }
  return x;
}

void OnlineFlow::BeginMotion() {
  arc_ended_ = false;
  motion_ = Arc();
  motion_.mode = flow_.mode();
  motion_.u = flow_.u();
  motion_.t_begin = motion_.t_end = flow_.t();
  motion_.x_begin = motion_.x_end = flow_.x();
}

void OnlineFlow::KeepMotion(bool keep) {
  keep_ = keep;
  motion_.dense = DenseArc();
}

Arc OnlineFlow::Motion() {
  Arc motion = motion_;
  if (!arc_ended_ && now_ > flow_.t() && Propose()) {
    motion.dense.Append(flow_.t(), flow_.proposed_length(), flow_.ProposedDense(),
                        system_->state_size());
    motion.t_end = now_;
    motion.x_end = State();
  }
  return motion;
}

void OnlineFlow::Forget(double t) {
  if (arc_ended_) {
    BeginMotion();
  } else {
    motion_.dense.DropBefore(t);
  }
}

}  // namespace contact_flow
