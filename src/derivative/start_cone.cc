// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/start_cone.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/driven.h"
#include "input_cluster.h"

namespace contact_flow {
namespace {

/// Rounding of a product of a gradient with a direction, relative to its terms.
constexpr double kConeNoise = 1e-9;
/// Slips that are rounding, relative to the velocities.
constexpr double kNoSlip = 1e-12;
/// Accelerations that vanish within this part of the gap's tolerance are not known.
constexpr double kIdleSpeed = 1e-3;
/// More impacts one behind another at the start are not followed.
constexpr int kMaxImpacts = 1000;

double Terms(const Vector& row, const VectorRef& w) { return row.cwiseAbs().dot(w.cwiseAbs()); }

std::string Sentence(double t, const std::string& name, const char* what) {
  std::ostringstream message;
  message << "at t = " << t << " s the start touches '" << name
          << "', which is not in the contact mode" << what;
  return message.str();
}

}  // namespace

StartCone::StartCone(ContactDynamics* dynamics, const VectorRef& x, ContactMode mode, double t,
                     double gap_tolerance, double speed_tolerance, ImpactLaw impact_law)
    : names_(dynamics->system().description().constraints),
      t_(t),
      dof_(dynamics->system().dof()),
      friction_(dynamics->system().HasFriction()),
      law_(impact_law) {
  const MechanicalSystem& system = dynamics->system();
  const int d = dof_, n = system.num_constraints(), k = dynamics->num_variables();
  const Vector q = x.head(system.num_positions()), v = x.tail(d);
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  ConstraintSet touching;
  for (int i = 0; i < n; ++i) {
    const bool touches = std::abs(terms.gap(i)) <= gap_tolerance;
    if (touches && (system.compliant().Contains(i) || !mode.Contains(i))) touching.Insert(i);
  }
  // Contacts that begin to slip from rest: to the one side they slip on, to the other they slip
  // against their friction and are reversed.
  ConstraintSet begins;
  for (int i : mode.SlippingInPlane()) {
    const double slip = terms.jacobian.row(system.friction()[i].row).dot(v);
    if (std::abs(slip) <= speed_tolerance) begins.Insert(i);
  }
  for (int i : mode - mode.Sticking()) {
    const Friction* friction = system.HasFriction() ? &system.friction()[i] : nullptr;
    if (friction == nullptr || friction->dimension < 2 || !(friction->coefficient > 0)) continue;
    if ((terms.jacobian.middleRows<2>(friction->row) * v).norm() > speed_tolerance) continue;
    status_ = {Outcome::kNotPiecewiseLinear,
               "at t = " + std::to_string(t) + " s contact '" + names_[i] +
                   "' begins to slip in space: derivatives across that are not offered"};
    return;
  }
  if (touching.Empty() && begins.Empty()) return;
  const Vector field = dynamics->Field(x, mode);
  // Gradients of gaps and of their rates.
  Matrix gaps = Matrix::Zero(n, 2 * d + k), rates = gaps;
  const Vector no_jump = Vector::Zero(d), no_impulse = Vector::Zero(terms.gap.size());
  ResidualJacobian residual;
  system.DifferentiateImpact(q, no_jump, no_impulse, v, &residual);
  gaps.leftCols(d) = terms.jacobian.topRows(n);
  rates.leftCols(d) = residual.constraint_q.topRows(n);
  rates.middleCols(d, d) = terms.jacobian.topRows(n);
  const std::vector<int>& parameters = dynamics->variables().parameters;
  Matrix by_slip;
  if (!parameters.empty()) {
    ParameterJacobian by_parameter;
    system.DifferentiateImpactByParameters(q, no_jump, no_impulse, v, parameters, &by_parameter);
    gaps.rightCols(parameters.size()) = by_parameter.gap.topRows(n);
    rates.rightCols(parameters.size()) = by_parameter.constraint.topRows(n);
    by_slip = by_parameter.constraint;
  }
  for (int i : begins) {
    const int row = system.friction()[i].row;
    const double sign = SlipSign(mode.LetterOf(i));
    Contact contact;
    contact.constraint = i;
    contact.slips = true;
    contact.speed = 1;  // not at rest: what matters is its slip
    const double slip = terms.jacobian.row(row).dot(v);
    if (std::abs(slip) > kNoSlip * v.cwiseAbs().maxCoeff()) contact.slip = sign * slip;
    contact.gap = contact.rate = Vector::Zero(2 * d + k);
    contact.gap.head(d) = sign * residual.constraint_q.row(row);
    contact.gap.segment(d, d) = sign * terms.jacobian.row(row);
    if (!parameters.empty()) contact.gap.tail(by_slip.cols()) = sign * by_slip.row(row);
    const bool alone = begins.Size() == 1 && touching.Empty() && mode.Sticking().Empty();
    if (alone) FollowReversal(dynamics, x, mode, &contact);
    contacts_.push_back(contact);
    if (contact.turn.size() > 0) continue;
    piecewise_linear_ = {Outcome::kNotDifferentiable,
                         "at t = " + std::to_string(t) + " s contact '" + names_[i] +
                             "' begins to slip from rest: directions to the other side are "
                             "reversed, which is not followed"};
  }
  const ConstraintSet of_time = DrivenSwitches(system, q, v);
  ConstraintSet members = mode - system.compliant();
  held_ = members.Size();
  for (int i : members) members_.push_back(i);
  std::vector<int> order = members_;
  for (int i : touching) {
    if (system.compliant().Contains(i)) {
      const ContactMode other = mode.Contains(i) ? mode.Without(i) : mode.With(i);
      const Vector jump = dynamics->Field(x, other) - field;
      const bool same =
          jump.cwiseAbs().maxCoeff() <= kConeNoise * (1 + field.cwiseAbs().maxCoeff());
      // On its other side contacts of the mode may be lifted.
      const bool held = !of_time.Contains(i) || HoldsAll(dynamics, x, other);
      if (same && held) continue;
      if (of_time.Contains(i)) {
        Contact contact = SwitchOf(i, (mode.Contains(i) ? -1 : 1) * gaps.row(i).transpose());
        const double rate = std::abs(terms.jacobian.row(i).dot(v));
        const bool alone = touching.Size() == 1 && begins.Empty() && held;
        if (alone) contact.turn = (mode.Contains(i) ? -1 : 1) / rate * jump;
        contacts_.push_back(contact);
        continue;
      }
      status_ = {Outcome::kNotDifferentiable,
                 Sentence(t, names_[i],
                          " or is at its surface: its force jumps there, and which side a "
                          "perturbed run starts on decides")};
      return;
    }
    Contact contact;
    contact.constraint = i;
    contact.gap = gaps.row(i).transpose();
    contact.rate = rates.row(i).transpose();
    const double speed = terms.jacobian.row(i).dot(v);
    if (speed > speed_tolerance) {
      contact.speed = speed;
    } else {
      contact.acceleration = contact.rate.dot(field);
      dynamics->Differentiate(x, mode);
      // What a change of the state by as much as touching is known to would make of it.
      const double change =
          (terms.jacobian.row(i) * dynamics->acceleration_jacobian().leftCols(2 * d)).lpNorm<1>();
      const double unknown =
          kConeNoise * Terms(contact.rate, field) + kIdleSpeed * gap_tolerance * change;
      if (!(contact.acceleration > unknown)) {
        status_ = {Outcome::kNotDifferentiable,
                   Sentence(t, names_[i],
                            " and neither leaves nor is pressed: whether it does in a perturbed "
                            "run is not decided by first order")};
        return;
      }
      order.push_back(i);
      piecewise_linear_ = {
          Outcome::kNotDifferentiable,
          Sentence(t, names_[i],
                   " and leaves from rest: directions into it lead out of the domain, those along "
                   "it may hit it at once, which pieces do not tell")};
    }
    contacts_.push_back(contact);
  }
  const InverseInertia inertia(system, q, v);
  const int count = static_cast<int>(order.size());
  Matrix A(count, d);
  rates_.resize(count, 2 * d + k);
  restitution_.resize(count);
  for (int r = 0; r < count; ++r) {
    A.row(r) = terms.jacobian.row(order[r]);
    rates_.row(r) = rates.row(order[r]);
    restitution_(r) = system.restitution()(order[r]);
  }
  reach_ = inertia * A.transpose();
  delassus_ = A * reach_;
}

bool StartCone::Closes(const Contact& contact, const VectorRef& w) const {
  return contact.gap.dot(w) < -kConeNoise * Terms(contact.gap, w);
}

bool StartCone::Stays(const Contact& contact, const VectorRef& w) const {
  return contact.gap.dot(w) <= kConeNoise * Terms(contact.gap, w);
}

ConstraintSet StartCone::Brushed(const VectorRef& w) const {
  ConstraintSet brushed;
  for (const Contact& contact : contacts_) {
    if (contact.at_rest() && Stays(contact, w)) brushed.Insert(contact.constraint);
  }
  return brushed;
}

int StartCone::Leaves(const VectorRef& w) const {
  for (const Contact& contact : contacts_) {
    if (contact.turn.size() == 0 && Closes(contact, w)) return contact.constraint;
  }
  return -1;
}

Vector StartCone::operator()(const VectorRef& direction) const {
  Vector w = direction;
  if (contacts_.empty()) return w;
  const int out = Leaves(w);
  if (out >= 0) {
    if (Reverses(out)) {
      throw std::invalid_argument("the direction moves the contact '" + names_[out] +
                                  "', which begins to slip at t = " + std::to_string(t_) +
                                  " s, against that slip: how it is reversed is not followed");
    }
    if (IsSwitch(out)) {
      throw std::invalid_argument("the direction moves the clock over '" + names_[out] +
                                  "', on which the run begins or ends, to the side that it is "
                                  "not on: forces jump there");
    }
    throw std::invalid_argument("the direction leads through the constraint '" + names_[out] +
                                "', which the start at t = " + std::to_string(t_) +
                                " s touches: it leaves the domain");
  }
  for (const Contact& contact : contacts_) {
    if (contact.turn.size() > 0 && Closes(contact, w)) w += contact.turn * contact.gap.dot(w);
  }
  for (int impacts = 0;; ++impacts) {
    const std::vector<int> rows = Hit(w);
    if (rows.empty()) return w;
    if (friction_) {
      Refuse(
          "a contact that leaves from rest is hit at the start in this direction: with friction "
          "that is not followed");
    }
    if (impacts == kMaxImpacts) {
      Refuse("the impacts at the start in this direction do not come to an end");
    }
    w.segment(dof_, dof_) += Impact(rows, w);
    for (int r = 0; r < held_ && law_ == ImpactLaw::kComplementarity; ++r) {
      const Vector rate = rates_.row(r).transpose();
      if (!(rate.dot(w) > kConeNoise * Terms(rate, w))) continue;
      Refuse("the contact '" + names_[members_[r]] +
             "' is lifted by an impact at the start in this direction: how it returns is not "
             "followed");
    }
  }
}

std::vector<int> StartCone::Hit(const VectorRef& w) const {
  std::vector<int> rows;
  for (int r = 0; r < held_; ++r) rows.push_back(r);
  bool hit = false;
  int row = held_;
  for (const Contact& contact : contacts_) {
    if (!contact.at_rest()) continue;
    const double rate = contact.rate.dot(w), noise = kConeNoise * Terms(contact.rate, w);
    if (Stays(contact, w) && rate <= noise) {
      rows.push_back(row);
      hit = hit || rate < -noise;
    }
    ++row;
  }
  if (!hit) rows.clear();
  return rows;
}

Vector StartCone::Impact(const std::vector<int>& rows, const VectorRef& w) const {
  const int count = static_cast<int>(rows.size());
  Matrix G(count, count), reach(dof_, count);
  Vector b(count);
  for (int r = 0; r < count; ++r) {
    for (int c = 0; c < count; ++c) G(r, c) = delassus_(rows[r], rows[c]);
    reach.col(r) = reach_.col(rows[r]);
    b(r) = rows[r] < held_ ? 0 : (1 + restitution_(rows[r])) * rates_.row(rows[r]).dot(w);
  }
  if (law_ == ImpactLaw::kProjection) {
    const Eigen::LLT<Matrix> factor(G);
    if (factor.info() == Eigen::Success) return reach * -factor.solve(b);
  } else if (const auto impact = SolveComplementarity(G, b)) {
    return reach * impact->z;
  }
  Refuse(
      "no impulses end the impact at the start in this direction: its contacts are dependent "
      "and jam (Assumption 3)");
}

void StartCone::Refuse(const std::string& what) const {
  throw std::domain_error("at t = " + std::to_string(t_) + " s " + what);
}

Matrix StartCone::Cone() const {
  Matrix cone(contacts_.size(), contacts_.empty() ? 0 : contacts_.front().gap.size());
  Eigen::Index rows = 0;
  for (const Contact& contact : contacts_) {
    if (contact.turn.size() == 0) cone.row(rows++) = contact.gap.normalized().transpose();
  }
  return cone.topRows(rows);
}

StartCone::Bound StartCone::Limit(const VectorRef& w) const {
  Bound bound;
  double smallest = std::numeric_limits<double>::infinity();
  const auto consider = [&](int i, double alpha) {
    if (alpha < smallest) bound = {i, smallest = alpha};
  };
  for (const Contact& contact : contacts_) {
    if (contact.turn.size() > 0) continue;
    if (Closes(contact, w)) consider(contact.constraint, 0);
    const double gap = contact.gap.dot(w), rate = contact.rate.dot(w);
    if (!(rate < -kConeNoise * Terms(contact.rate, w))) continue;
    // The gap αg + (speed + αr) t + ä t²/2 must not have a root.
    if (!contact.at_rest()) {
      consider(contact.constraint, contact.speed / -rate);
    } else if (gap > kConeNoise * Terms(contact.gap, w)) {
      consider(contact.constraint, 2 * contact.acceleration * gap / (rate * rate));
    }
  }
  return bound;
}

}  // namespace contact_flow
