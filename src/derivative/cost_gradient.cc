// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/cost_gradient.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "cost_rate.h"
#include "end_event.h"
#include "linear_run.h"

namespace contact_flow {
namespace {

/// Rounding of speeds, beside those that accelerations make in the time of the run.
constexpr double kSpeedRounding = 1e-14;
/// A force that vanishes in this part of the run has vanished.
constexpr double kLeftForce = 1e-6;

/// The passage of the covector λ through a run, backward.
class Passage {
 public:
  Passage(const MechanicalSystem& system, const Trajectory& trajectory, const RunCost& cost,
          const BDerivativeOptions& options, const RunDirection* direction, const InputCones& cones)
      : system_(system),
        run_(trajectory),
        cost_(cost),
        d2_(2 * system.dof()),
        linear_(system, trajectory, cost, options, direction, cones) {}

  CostGradient Differentiate() {
    try {
      if (linear_.Make(&gradient_)) {
        ConstraintSet switches;  // at the end: the gradient is that of the side the run is on
        if (cost_.terminal) {
          gradient_.status = CheckEnd(system_, run_, linear_.state_error(), &switches);
        }
        gradient_.whole = gradient_.whole && switches.Empty();
        if (gradient_.status.ok()) Retreat();
      }
    } catch (const NotPiecewiseLinear& reason) {
      gradient_.status = {Outcome::kNotPiecewiseLinear, reason.what()};
    } catch (const std::domain_error& reason) {
      gradient_.status = {Outcome::kNotDifferentiable, reason.what()};
    } catch (const BudgetExceeded& reason) {
      gradient_.status = {OutcomeOf(reason), reason.what()};
    }
    return gradient_;
  }

 private:
  double Rate(const Vector& x, const Vector& u, ContactMode mode) const {
    return RateOf(cost_, time_, x, u, mode);
  }

  /// l_{i−1} − l_i at the events of a piece: what each costs by coming later.
  Vector Delays(std::size_t k, const EventPiece& piece) {
    const Transition& transition = linear_.derivative().events[k].transition();
    Vector delays = Vector::Zero(piece.times.rows());
    if (!cost_.HasRate()) return delays;
    time_ = transition.t;
    Vector x = transition.x_minus;
    double last = Rate(x, run_.arcs[k].u, transition.mode_before);
    for (std::size_t i = 0; i < piece.velocities.size(); ++i) {
      x.tail(system_.dof()) = piece.velocities[i];
      const bool is_last = i + 1 == piece.velocities.size();
      const double next =
          Rate(x, piece.inputs[i], is_last ? transition.mode_after : piece.modes[i]);
      delays(static_cast<Eigen::Index>(i)) = last - next;
      last = next;
    }
    return delays;
  }

  /// Those that a transition lets go by a guard of their own.
  ConstraintSet LetGo(const Transition& event) const {
    ConstraintSet own = event.vanishing;
    const Guards guards(system_);
    for (int g : event.guards) own.Insert(guards.ConstraintOf(g));
    return own & event.released;
  }

  /// A contact lets go, and what it costs while it touches ends with it: later by −Dλ w / (Dλ F).
  /// Returns what that costs for each second.
  double PassRelease(std::size_t k, Vector* lambda) {
    const Transition& event = linear_.derivative().events[k].transition();
    if (!cost_.running_in_mode || event.released.Empty()) return 0;
    const ConstraintSet own = LetGo(event);
    const bool alone = event.activated.Empty() && !event.changes_input;
    if (own.Empty() && !alone) return 0;  // it lets go at the touchdown, or as the input changes
    const Arc& arc = run_.arcs[k];
    const Vector& x = event.x_minus;
    time_ = event.t;
    const ContactMode after = alone ? event.mode_after : event.mode_before.Without(own);
    const double jump = Rate(x, arc.u, event.mode_before) - Rate(x, arc.u, after);
    if (jump == 0) return 0;
    ContactDynamics dynamics(system_, arc.u, linear_.derivative().options.variables);
    const Vector field = dynamics.Field(x, event.mode_before);
    dynamics.Differentiate(x, event.mode_before);
    const int i = *event.released.begin();
    const Vector gradient = dynamics.force_jacobian().row(i).transpose();
    const double rate = gradient.dot(field);
    // At a cone it may let go while it pushes.
    const double left = kLeftForce * std::abs(rate) * (run_.t_end() - run_.t_begin());
    const bool vanishes = std::abs(dynamics.force()(i)) <= left;
    if (!alone || own.Size() != 1 || event.released != own || !vanishes) {
      std::ostringstream message;
      message << "at t = " << time_ << " s contacts "
              << event.released.ToString(system_.description().constraints)
              << " let go at once, with other events, or while they push, and the running cost "
              << "jumps by " << -jump << ": what it is between them is not known";
      throw std::domain_error(message.str());
    }
    *lambda -= jump / rate * gradient;
    return jump;
  }

  void Retreat() {
    const Vector& x = run_.FinalState();
    Vector lambda = Vector::Zero(linear_.size());
    if (cost_.terminal) {
      Vector by_state = Vector::Zero(x.size());
      gradient_.cost += cost_.terminal(x, &by_state);
      lambda.head(d2_) = ByTangents(system_, x, by_state);
      for (Eigen::Index i = 0; i < d2_; ++i) {
        if (lambda(i) != 0) gradient_.cost_error += std::abs(lambda(i)) * linear_.state_error()(i);
      }
    }
    gradient_.horizon = lambda.head(d2_).dot(linear_.derivative().time) +
                        linear_.arc(run_.arcs.size() - 1).end().rate;
    if (run_.input_changes_at_end) gradient_.horizon = std::numeric_limits<double>::quiet_NaN();
    const Eigen::Index count = linear_.intervals();
    gradient_.inputs = Matrix::Zero(linear_.inputs(), linear_.inputs() > 0 ? count : 0);
    gradient_.instants = Vector::Zero(count - 1);
    Eigen::Index interval = count - 1;
    BudgetStage stage("the gradient, arc by arc", run_.arcs.size());
    for (std::size_t k = run_.arcs.size(); k-- > 0; stage.Next()) {
      AskBudget();
      PassArc(k, &lambda);
      if (k == 0) break;
      PassEvent(k - 1, interval, &lambda);
      if (run_.transitions[k - 1].changes_input) TakeInput(interval--, &lambda);
    }
    TakeInput(0, &lambda);
    if (!linear_.derivative().start_stop.Empty()) {
      lambda = linear_.derivative().start_stop.matrix().transpose() * lambda;
    }
    gradient_.initial = lambda.head(d2_);
    gradient_.parameters = lambda.tail(linear_.parameters());
    const bool finite = lambda.allFinite() && gradient_.inputs.allFinite() &&
                        gradient_.instants.allFinite() && std::isfinite(gradient_.cost) &&
                        std::isfinite(gradient_.horizon);
    if (!finite) {
      throw std::domain_error("the gradient is beyond the numbers there are");
    }
    CheckTransposed();
  }

  void TakeInput(Eigen::Index interval, Vector* lambda) {
    if (linear_.inputs() == 0) return;
    gradient_.inputs.col(interval) = lambda->segment(d2_, linear_.inputs());
    lambda->segment(d2_, linear_.inputs()).setZero();
  }

  /// By what the error of the state leaves l unknown at the end of an arc. Speeds that contacts
  /// hold at zero are sums of what would be without them, and rounding is all that is left.
  double UnknownRate(std::size_t k) {
    const Arc& arc = run_.arcs[k];
    const Eigen::Index d = d2_ / 2;
    time_ = arc.t_end;
    ContactDynamics free(system_, arc.u);
    const double length = run_.t_end() - run_.t_begin();
    Vector error = linear_.state_error();
    error.tail(d) +=
        kSpeedRounding * length * free.Field(arc.x_end, ContactMode()).segment(d, d).cwiseAbs();
    const Vector disturbed = system_.Perturb(arc.x_end, error);
    return std::abs(Rate(disturbed, arc.u, arc.mode) - Rate(arc.x_end, arc.u, arc.mode));
  }

  /// λᵀF + l changes by ∫ ∂l/∂t along an arc; F at its end as the tangents carry it there, so that
  /// errors of the state do not count.
  void PassArc(std::size_t k, Vector* lambda) {
    const ArcTangents& arc = linear_.arc(k);
    Matrix carried = Matrix::Zero(lambda->size(), 1);
    carried.col(0).head(d2_) = arc.begin().field;
    arc.Forward(&carried);
    const Vector later = lambda->head(d2_).cwiseProduct(carried.col(0).head(d2_));
    // Sources of variables are no part of F.
    arc.Backward(lambda);
    const Vector earlier = lambda->head(d2_).cwiseProduct(arc.begin().field);
    if (cost_.HasRate()) unknown_rate_ = std::max(unknown_rate_, UnknownRate(k));
    NoteLaw(later.sum() + arc.end().rate - arc.drift() - earlier.sum() - arc.begin().rate,
            later.lpNorm<1>() + earlier.lpNorm<1>() + std::abs(arc.end().rate) +
                std::abs(arc.begin().rate));
  }

  void PassEvent(std::size_t k, Eigen::Index interval, Vector* lambda) {
    const EventMap& event = linear_.derivative().events[k];
    const EventPiece& piece = linear_.piece(k);
    const Vector& before = linear_.arc(k).end().field;
    const ClusterReport& cluster = event.cluster();
    const Eigen::Index d = d2_ / 2;
    if (cluster.neglected_jump.size() == d) {
      gradient_.neglected_jump += lambda->segment(d, d).cwiseAbs().dot(cluster.neglected_jump);
    }
    if (event.absorbed()) return;
    const bool alone = run_.transitions[k].changes_input && event.num_input_changes() == 0;
    if (piece.matrix.size() == 0) {
      const ArcTangents::End &first = linear_.arc(k).end(), &second = linear_.arc(k + 1).begin();
      gradient_.instants(interval - 1) =
          lambda->head(d2_).dot(first.field - second.field) + first.rate - second.rate;
      return;
    }
    const Vector delays = Delays(k, piece);
    Vector field = Vector::Zero(lambda->size());
    field.head(d2_) = before;
    const double later = lambda->dot(piece.matrix * field);
    for (Eigen::Index j = 0; j < piece.by_instants.cols(); ++j) {
      // Its changes of the input, of which the last may be that of a later transition.
      gradient_.instants(FirstInstant(k) + j) =
          lambda->dot(piece.by_instants.col(j)) + delays.dot(piece.times_by_instants.col(j));
    }
    if (alone) {
      const ArcTangents::End &first = linear_.arc(k).end(), &second = linear_.arc(k + 1).begin();
      gradient_.instants(interval - 1) =
          later - lambda->head(d2_).dot(second.field) + first.rate - second.rate;
    }
    *lambda = piece.matrix.transpose() * *lambda;
    if (delays.size() > 0) *lambda += piece.times.transpose() * delays;
    const double released = PassRelease(k, lambda);
    if (alone || event.num_input_changes() > 0) return;
    // A run that is late is late at each of the events: ∂τ_i F⁻ = −1.
    NoteLaw(later - delays.sum() - released - lambda->dot(field),
            std::abs(later) + delays.lpNorm<1>() + std::abs(released) +
                lambda->head(d2_).cwiseProduct(before).lpNorm<1>());
  }

  /// The number of the first instant of the grid from transition k on, from 0.
  Eigen::Index FirstInstant(std::size_t k) const {
    Eigen::Index number = 0;
    for (std::size_t i = 0; i < k; ++i) number += run_.transitions[i].changes_input;
    return number;
  }

  void NoteLaw(double residual, double size) {
    law_size_ = std::max(law_size_, size);
    const double left = std::max(0.0, std::abs(residual) - unknown_rate_);
    if (law_size_ > 0) gradient_.law = std::max(gradient_.law, left / law_size_);
  }
  void CheckTransposed() const {
    if (gradient_.law <= kLawLimit) return;
    std::ostringstream message;
    message << "the self-check that λᵀF + l is constant fails by " << gradient_.law << " (limit "
            << kLawLimit << ")"
            << (cost_.HasRate() ? ": are the derivatives of the running cost right?" : "")
            << " The gradient is withheld";
    throw std::domain_error(message.str());
  }

  const MechanicalSystem& system_;
  const Trajectory& run_;
  const RunCost& cost_;
  const Eigen::Index d2_;
  LinearRun linear_;
  CostGradient gradient_;
  double time_ = 0, law_size_ = 0, unknown_rate_ = 0;
};

}  // namespace

Vector RunDirection::AtStart(const MechanicalSystem& system, const Variables& variables) const {
  const int d2 = 2 * system.dof(), m = system.num_inputs();
  Vector w = Vector::Zero(d2 + variables.Size(system));
  if (initial.size() > 0) w.head(d2) = initial;
  if (variables.inputs && inputs.size() > 0) w.segment(d2, m) = inputs.col(0);
  if (parameters.size() > 0) w.tail(parameters.size()) = parameters;
  return w;
}

void CostGradient::KeepStart(const MechanicalSystem& system, const Variables& variables,
                             const StartDirections& starts) {
  if (!status.ok() || starts.KeepsAll()) return;
  const RunDirection by = {initial, inputs, parameters};
  const Vector kept = starts.Projector().transpose() * by.AtStart(system, variables);
  initial = kept.head(initial.size());
  parameters = kept.tail(parameters.size());
}

double CostGradient::Along(const RunDirection& w) const {
  RequireDirectionSize(w.initial.size(), initial.size(), "initial");
  RequireDirectionSize(w.inputs.size(), inputs.size(), "inputs");
  RequireDirectionSize(w.parameters.size(), parameters.size(), "parameters");
  double sum = 0;
  if (w.initial.size() > 0) sum += initial.dot(w.initial);
  if (w.inputs.size() > 0) {
    sum += Eigen::Map<const Vector>(inputs.data(), inputs.size())
               .dot(Eigen::Map<const Vector>(w.inputs.data(), w.inputs.size()));
  }
  if (w.parameters.size() > 0) sum += parameters.dot(w.parameters);
  return sum;
}

CostGradient DifferentiateCost(const MechanicalSystem& system, const Trajectory& trajectory,
                               const RunCost& cost, const BDerivativeOptions& options,
                               const RunDirection* direction) {
  return DifferentiateCost(system, trajectory, cost, options, direction, {});
}

CostGradient DifferentiateCost(const MechanicalSystem& system, const Trajectory& trajectory,
                               const RunCost& cost, const BDerivativeOptions& options,
                               const RunDirection* direction, const InputCones& cones) {
  if (!cost.terminal && !cost.HasRate()) {
    throw std::invalid_argument("cost: nothing costs anything");
  }
  return Passage(system, trajectory, cost, options, direction, cones).Differentiate();
}

}  // namespace contact_flow
