// SPDX-License-Identifier: BSD-3-Clause
#include "touching_contacts.h"

#include <algorithm>
#include <sstream>
#include <utility>
#include <vector>

namespace contact_flow {
namespace {

/// Up to this many are opened in every combination; of more, all at once.
constexpr std::size_t kMaxOpened = 4;
/// What the tolerance of propagators leaves of a tangent that keeps a contact, relative.
constexpr double kKeptRow = 1e-6;

}  // namespace

bool JudgeTouching(ContactDynamics* dynamics, const Transition& transition,
                   const TouchingFrame& frame, ConstraintSet open, SequenceRules rules,
                   ClusterReport* report) {
  const MechanicalSystem& system = dynamics->system();
  const Vector v_plus = transition.x_plus.tail(system.dof());
  std::vector<ConstraintSet> later = {ConstraintSet()};  // subsets that touch a little later
  if (open.Size() > static_cast<int>(kMaxOpened)) {
    later.push_back(open);
  } else {
    for (int i : open) {
      const std::size_t count = later.size();
      for (std::size_t k = 0; k < count; ++k) later.push_back(later[k].With(i));
    }
  }
  bool followed = open.Size() <= static_cast<int>(kMaxOpened);
  double apart = 0;
  // One that is apart decides, and so does one that is not followed to its end.
  for (std::size_t k = 1; k < later.size() && apart == 0 && (followed || k == 1); ++k) {
    rules.shut = transition.touching - later[k];
    const ImpactSequences sequences(dynamics, transition, frame, rules);
    followed = followed && sequences.all;
    for (const OrderOutcome& outcome : sequences.outcomes) {
      followed = followed && outcome.status.ok();
      if (!outcome.status.ok() || rules.same(outcome.v_plus, v_plus)) continue;
      apart = std::max(apart, (outcome.v_plus - v_plus).cwiseAbs().maxCoeff());
    }
  }
  if (apart == 0 && followed) return true;
  const std::vector<std::string>& names = system.description().constraints;
  std::ostringstream message;
  message << "at t = " << transition.t << " s the contacts " << open.ToString(names)
          << " touch without force and take part in the impact of "
          << transition.activated.ToString(names)
          << ", all at once by Newton's law (simultaneous Newton-Moreau): ";
  if (apart > 0) {
    message << "where they touch a little later the impacts come one after another, to velocities "
            << apart << " apart; the outcome is discontinuous here";
    report->contact_class = ContactClass::kOrderDependent;
    report->status = {Outcome::kDiscontinuous, message.str()};
  } else {
    message << "whether the outcome is another where they touch a little later is undecided";
    report->contact_class = ContactClass::kUndecided;
    report->status = {Outcome::kNotDifferentiable, message.str()};
  }
  report->outcomes = ListOrderOutcomes(dynamics, transition);
  return false;
}

Status CheckTouching(ContactDynamics* dynamics, const Transition& transition,
                     const Matrix& tangents) {
  if (transition.touching.Empty()) return {};
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof();
  const Vector q = transition.x_minus.head(system.num_positions());
  const Vector v = transition.x_minus.tail(d);
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  const Vector no_jump = Vector::Zero(d), no_impulse = Vector::Zero(terms.gap.size());
  ResidualJacobian residual;
  system.DifferentiateImpact(q, no_jump, no_impulse, v, &residual);
  const std::vector<int>& parameters = dynamics->variables().parameters;
  ParameterJacobian by_parameter;
  if (!parameters.empty()) {
    system.DifferentiateImpactByParameters(q, no_jump, no_impulse, v, parameters, &by_parameter);
  }
  Eigen::RowVectorXd gap = Eigen::RowVectorXd::Zero(tangents.rows()), rate = gap;
  for (int i : transition.touching) {
    gap.head(d) = terms.jacobian.row(i);
    rate.head(d) = residual.constraint_q.row(i);
    rate.segment(d, d) = terms.jacobian.row(i);
    if (!parameters.empty()) {
      const auto size = static_cast<Eigen::Index>(parameters.size());
      gap.tail(size) = by_parameter.gap.row(i);
      rate.tail(size) = by_parameter.constraint.row(i);
    }
    for (const Eigen::RowVectorXd& row : {gap, rate}) {
      const double size = (row.cwiseAbs() * tangents.cwiseAbs()).maxCoeff();
      if ((row * tangents).cwiseAbs().maxCoeff() <= kKeptRow * size) continue;
      std::ostringstream message;
      message
          << "at t = " << transition.t << " s the contact '"
          << system.description().constraints[static_cast<std::size_t>(i)]
          << "' touches without force when it is "
          << (transition.activated.Empty() ? "pressed" : "hit")
          << "; a perturbed run may touch it earlier, later or not, which is not differentiated";
      return {Outcome::kNotDifferentiable, message.str()};
    }
  }
  return {};
}

}  // namespace contact_flow
