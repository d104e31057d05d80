// SPDX-License-Identifier: BSD-3-Clause
// What EventMap knows of the instants, stages and passages of a cluster: (ρ, v_S), K_S, F_S and
// the resets between them, each made once.
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "cluster_geometry.h"
#include "contact_flow/budget.h"
#include "contact_flow/derivative/event_map.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/model/row_layout.h"
#include "src/dynamics/mode_selection.h"
#include "src/dynamics/plastic_impact.h"

namespace contact_flow {
namespace {

/// A contact is disturbed by the impact of another where its rate afterwards changes by more than
/// this part of the terms that it is the sum of, along tangents that keep all contacts closed.
constexpr double kStructural = 1e-8;

/// The last impact with what the run made rest behind it, `held`: contacts that rise, are pressed
/// back at once and land, so low that nothing is felt of it but impulses along their rows. Those
/// lead from v⁺ to the one velocity where all of them rest, whatever the bounces were. Speeds of
/// `known` in the kinetic metric are none.
ImpactResult MadeRest(const MechanicalSystem& system, const VectorRef& q,
                      const ClusterGeometry& geometry, double known, ConstraintSet held,
                      ImpactResult impact) {
  bool rests = true;
  for (int j : held) {
    rests = rests && std::abs(geometry.Rate(j, impact.v_plus)) <= known * geometry.mobility()(j);
  }
  if (rests) return impact;
  const ImpactResult rest = PlasticImpact(system, q, impact.v_plus, held);
  impact.v_plus = rest.v_plus;
  impact.impulse += rest.impulse;
  return impact;
}

}  // namespace

/// Speeds in the kinetic metric, |Da_j v| / √G_jj, are compared: neither units nor masses matter.
ConstraintSet EventMap::Resting(const Vector& v, ConstraintSet candidates,
                                ConstraintSet elastic) const {
  ConstraintSet resting;
  for (int j : candidates - elastic) {
    if (std::abs(geometry_->Rate(j, v)) <= rest_ * geometry_->mobility()(j)) resting.Insert(j);
  }
  return resting;
}

void EventMap::AddInstant(ConstraintSet S, const Vector& v, const SparseRows* rates_q) const {
  if (instants_.count(S) > 0) return;
  Instant& instant = instants_[S];
  instant.v = v;
  const ConstraintSet aside = Aside();
  if (S.Empty()) {
    instant.resting = (transition_.mode_before - aside) | transition_.touching;
  } else {
    ConstraintSet elastic;  // members of S that have bounced
    for (int j : S& transition_.activated) {
      if (system_->restitution()(j) > 0) elastic.Insert(j);
    }
    const ConstraintSet rested = (transition_.mode_before - aside) | transition_.touching;
    instant.resting = Resting(v, rested | (S & transition_.activated), elastic);
    if (S == events_) instant.resting = instant.resting | (transition_.mode_after - aside);
  }
  if (geometry_ == nullptr) return;  // nothing happens in it
  instant.rates.by_q = rates_q != nullptr ? *rates_q : geometry_->RatesBy(v);
  instant.rates.jacobian = geometry_->jacobian();
  instant.rates.size = size();
  const std::vector<int>& parameters = dynamics_->variables().parameters;
  if (parameters.empty()) return;
  ParameterJacobian by_parameter;
  system_->DifferentiateImpactByParameters(q_, Vector::Zero(system_->dof()),
                                           Vector::Zero(system_->num_rows()), v, parameters,
                                           &by_parameter);
  instant.rates.by_parameter = std::move(by_parameter.constraint);
  instant.rates.first_parameter = width() - static_cast<Eigen::Index>(parameters.size());
}

/// Where all that is closed pushes clearly there is no choice, and ρ is known.
bool EventMap::PushAll(ConstraintSet S, ConstraintSet closed, Stage* stage) const {
  const ConstraintSet after = transition_.mode_after - Aside();
  const bool last = S == events_ && (after - closed).Empty();
  const bool rough = system_->HasFriction();
  if (S.Empty() || last || closed.Empty() || system_->HasContactEffort() || rough) return false;
  if (!geometry_->HasProducts()) return false;
  const int d = system_->dof();
  Vector acceleration;
  const ContactMode mode = ModeAside(S).Union(ContactMode(closed));
  const bool clear = geometry_->Accelerate(DynamicsAfter(S).u(), stage->v, mode,
                                           InstantAt(S).rates.by_q, &acceleration);
  if (!clear) return false;
  stage->mode = mode;
  stage->field.setZero(size());
  stage->field.head(2 * d) << stage->v, acceleration;
  stage->field.tail(num_input_changes()).setOnes();
  return true;
}

const EventMap::Stage& EventMap::StageAt(ConstraintSet S, ConstraintSet closed) const {
  const auto known = stages_.find({S, closed});
  if (known != stages_.end()) return known->second;
  AskBudget();
  Stage stage;
  stage.v = InstantAt(S).v;
  if (PushAll(S, closed, &stage)) return stages_[{S, closed}] = std::move(stage);
  const Vector x = State(stage.v);
  const ContactMode after = transition_.mode_after;
  if (S.Empty()) {
    stage.mode = transition_.mode_before;
  } else if (S == events_ && (after - Aside() - closed).Empty()) {
    stage.mode = after;
  } else {
    stage.mode = SelectContactMode(&DynamicsAfter(S), x, closed, {}, ModeAside(S));
  }
  stage.field.setOnes(size());
  stage.field.head(width()) = DynamicsAfter(S).Field(x, stage.mode);
  return stages_[{S, closed}] = std::move(stage);
}

const EventMap::Passage& EventMap::PassageAt(ConstraintSet S, ConstraintSet closed, int i) const {
  const auto known = passages_.find({S, closed, i});
  if (known != passages_.end()) return known->second;
  AskBudget();
  Passage passage;
  const Instant& before = InstantAt(S);
  if (!transition_.activated.Contains(i)) {  // no impact: the field changes, the state does not
    AddInstant(S.With(i), before.v);
    passage.reset = ImpactReset(size());
    passage.held = closed & InstantAt(S.With(i)).resting;
    return passages_[{S, closed, i}] = std::move(passage);
  }
  // Every contact that rests takes part, also one that has opened: its gap is of second order, and
  // it is closed again if this impact pushes it.
  const ImpactResult impact = SolveImpact(*system_, *geometry_->inertia(), before.v,
                                          before.resting.With(i), transition_.impact_law);
  const ConstraintSet rests =
      S.With(i) == events_ ? transition_.mode_after - Aside() : ConstraintSet();
  const ImpactResult whole = MadeRest(*system_, q_, *geometry_, known_, rests, impact);
  std::shared_ptr<const ImpactReset::Terms> terms;
  if (geometry_->HasProducts()) terms = geometry_->Terms(whole, before.rates.by_q, size());
  AddInstant(S.With(i), whole.v_plus, terms ? &terms->after_q : nullptr);
  const ConstraintSet resting = InstantAt(S.With(i)).resting;
  // By projection all that are closed are equalities, however small their impulse, or none.
  if (transition_.impact_law == ImpactLaw::kProjection) passage.struck = closed;
  for (int j : impact.hit) {
    const bool pushed = std::abs(impact.impulse(j)) * geometry_->mobility()(j) > rest_;
    if (j == i || pushed) passage.struck.Insert(j);
  }
  passage.held = (closed | passage.struck) & resting;
  const ConstraintSet persisting = passage.held.Without(i);
  passage.reset = Reset(S, i, whole, terms, persisting);
  FindDisturbed(S, closed, i, whole, terms, &passage);
  for (int j : Brushed(before, i, impact)) {
    if (passage.disturbed.Contains(j) || !closed.Contains(j)) RefuseBrushed(i, j);
  }
  if (passage.held.Contains(i) && !dynamics_->variables().parameters.empty()) {
    // By its restitution, which is a parameter, it may rise.
    const Eigen::RowVectorXd rate = InstantAt(S.With(i)).rates.Row(i);
    const Matrix& reset = passage.reset.matrix();
    const double size = (rate.cwiseAbs() * reset.cwiseAbs()).norm();
    if ((rate * reset).norm() > kStructural * size) passage.disturbed.Insert(i);
  }
  return passages_[{S, closed, i}] = std::move(passage);
}

/// The change of a rate is a row c, that of its terms a row t; |c w| beside |t w| for two mixtures
/// w tells c = 0 from |c| > kStructural |t| but by chance, which kChance makes rare: what is not
/// told apart is computed.
bool EventMap::NoneDisturbed(ConstraintSet S, ConstraintSet quiet, int i,
                             const ImpactReset& free) const {
  constexpr double kChance = 1e-2;
  constexpr double kSteps[] = {0.6180339887498949, 0.4142135623730950};
  const Instant &before = InstantAt(S), &after = InstantAt(S.With(i));
  Vector w(size());
  for (const double step : kSteps) {
    double part = 0;
    for (int c = 0; c < w.size(); ++c) {
      part += step;
      part -= std::floor(part);
      w(c) = (c % 3 == 1 ? -1 : 1) * (0.6 + 0.8 * part);
    }
    const Vector passed = free * w;
    for (int j : quiet) {
      // Of what is closed the rate before is zero along the tangents in question.
      const double change = after.rates.Along(j, passed) - before.rates.Along(j, w);
      if (std::abs(change) > kChance * kStructural * after.rates.Terms(j, passed)) return false;
    }
  }
  return true;
}

/// Where such a push is real, contacts around here are all pushed, or all lifted; where it is taken
/// for none, direction decides. Both hold on one side of perturbations of its own size.
ConstraintSet EventMap::Brushed(const Instant& before, int i, const ImpactResult& impact) const {
  ConstraintSet brushed;
  if (transition_.impact_law == ImpactLaw::kProjection) return brushed;
  for (int j : before.resting.Without(i)) {
    const double mobility = geometry_->mobility()(j);
    const double push = std::abs(impact.impulse(j)) * mobility;
    const double rate = geometry_->Rate(j, impact.v_plus) / mobility;
    const double size = std::max(push, rate);
    if (size > known_ && size <= rest_) brushed.Insert(j);
  }
  return brushed;
}

void EventMap::RefuseBrushed(int i, int j) const {
  const std::vector<std::string>& names = system_->description().constraints;
  std::ostringstream message;
  message << "at t = " << transition_.t << " s the impact of '" << names[i] << "' moves '"
          << names[j] << "', which rests, so little that perturbations of that size decide "
          << "whether it does: there are two derivatives, and neither holds for both";
  throw std::domain_error(message.str());
}

ImpactReset EventMap::Reset(ConstraintSet S, int i, const ImpactResult& impact,
                            const std::shared_ptr<const ImpactReset::Terms>& terms,
                            ConstraintSet persisting) const {
  const ConstraintSet hit = persisting.With(i);
  if (terms) return ImpactReset(terms, hit, persisting);
  return ImpactReset(Widen(ImpactJacobian(*system_, *geometry_->inertia(), q_, InstantAt(S).v,
                                          impact, hit, persisting, dynamics_->variables())));
}

/// The derivative of the solution of a complementarity problem solves one itself: an impulse that
/// is positive stays (equality), one that vanishes with its complement, the normal velocity
/// afterwards, is 0 ≤ δp ⟂ δr ≥ 0. Where δr at δp = 0 vanishes along all tangents that keep the
/// contacts closed there is nothing to decide.
void EventMap::FindDisturbed(ConstraintSet S, ConstraintSet closed, int i,
                             const ImpactResult& impact,
                             const std::shared_ptr<const ImpactReset::Terms>& terms,
                             Passage* passage) const {
  const Instant &before = InstantAt(S), &after = InstantAt(S.With(i));
  const ConstraintSet quiet = (before.resting - passage->struck) & after.resting;
  const bool constant = system_->HasConstantMass() && system_->HasAffineConstraints() &&
                        dynamics_->variables().parameters.empty();
  if (quiet.Empty() || constant) return;
  const auto reset_without = [&](ConstraintSet free) {
    return Reset(S, i, impact, terms, (passage->held - free).Without(i));
  };
  const ImpactReset reset_free = reset_without(quiet);
  if (terms && NoneDisturbed(S, quiet, i, reset_free)) return;
  const Matrix& free = reset_free.matrix();
  // Tangents at the instant of the impact: gaps and rates of what is closed vanish.
  const ConstraintSet touching = before.resting.With(i);
  const int l = system_->num_bilateral();
  Matrix kept(touching.Size() + closed.Size() + 2 * l, size());
  int row = 0;
  for (int j : touching) kept.row(row++) = guards_.row(j);
  for (int j : closed) kept.row(row++) = before.rates.Row(j);
  kept.middleRows(row, l) = bilateral_;
  for (int j = 0; j < l; ++j) {
    kept.row(row + l + j) = before.rates.Row(RowLayout(*system_).OfBilateral(j));
  }
  const Eigen::CompleteOrthogonalDecomposition<Matrix> normals(kept.transpose());
  for (int j : quiet) {
    const Eigen::RowVectorXd rate = after.rates.Row(j);
    Vector change = (rate * free).transpose();
    if (!closed.Contains(j)) change -= before.rates.Row(j).transpose();
    const double size = (rate.cwiseAbs() * free.cwiseAbs()).norm();
    change -= kept.transpose() * normals.solve(change);
    if (change.norm() > kStructural * size) passage->disturbed.Insert(j);
  }
  const ConstraintSet lifted = passage->disturbed & closed;
  if (!lifted.Empty()) passage->free = lifted == quiet ? reset_free : reset_without(lifted);
}

const EventMap::Stage& EventMap::Activate(ConstraintSet S, int i, const ImpactReset** reset) const {
  const ConstraintSet aside = Aside();
  const Passage& passage = PassageAt(S, StageAt(S).mode - aside, i);
  const Stage& stage = StageAt(S.With(i));
  *reset = &passage.reset;
  // A contact that let go at an earlier stage and holds again at this one has opened by O(|w|²) and
  // falls back with a speed O(|w|): its plastic impact is one more reset, and where the map is
  // linear its time does not matter.
  const ConstraintSet held = stage.mode - aside;
  ConstraintSet at_rest = passage.held.With(i);
  if (passage.disturbed.Contains(i)) at_rest.Erase(i);
  const ConstraintSet regained = held - at_rest;
  if (regained.Empty()) return stage;
  const auto known = regained_.find({S, i});
  if (known != regained_.end()) {
    *reset = &known->second;
    return stage;
  }
  ImpactResult closing;
  closing.v_plus = stage.v;
  closing.impulse = Vector::Zero(system_->num_rows());
  const Matrix landing = Widen(ImpactJacobian(*system_, *geometry_->inertia(), q_, stage.v, closing,
                                              held, held, dynamics_->variables()));
  Matrix both = landing * passage.reset.matrix();
  *reset = &regained_.emplace(std::pair(S, i), ImpactReset(std::move(both))).first->second;
  return stage;
}

}  // namespace contact_flow
