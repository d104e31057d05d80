// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/event_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/dynamics/impact.h"

namespace contact_flow {
namespace {

/// Relative size of G_ij below which two constraints count as orthogonal: the located configuration is
/// exact only up to the integrator's tolerance.
constexpr double kOrthogonal = 1e-6;
/// |Da_j v| below this part of the approach speeds counts as rest.
constexpr double kRest = 1e-9;
/// First-order times that differ by less than this, relative, coincide.
constexpr double kTie = 1e-8;
constexpr int kMaxModularActivations = 12;

std::vector<int> Members(ContactMode mode) {
  std::vector<int> members;
  for (int i : mode) members.push_back(i);
  return members;
}

}  // namespace

EventMap::EventMap(std::shared_ptr<ContactDynamics> dynamics, const Transition& transition)
    : dynamics_(std::move(dynamics)),
      system_(&dynamics_->system()),
      transition_(transition),
      q_(transition.x_minus.head(system_->dof())),
      activated_(Members(transition.activated)) {
  const int d = system_->dof();
  const Vector v_minus = transition.x_minus.tail(d);
  ConstraintTerms terms;
  system_->Constraints(q_, v_minus, &terms);
  jacobian_ = terms.jacobian;
  stages_[ContactMode()] = {v_minus, transition.mode_before,
                            dynamics_->Field(transition.x_minus, transition.mode_before)};
  Classify();
}

Vector EventMap::State(const Vector& v) const {
  Vector x(q_.size() + v.size());
  x << q_, v;
  return x;
}

void EventMap::Classify() {
  if (num_activations() < 2) return;
  const ContactMode touching = transition_.activated | transition_.mode_before;
  Matrix G;
  Vector unused;
  Delassus(*system_, transition_.x_minus, dynamics_->u(), touching, &G, &unused);
  const std::vector<int> members = Members(touching);
  bool plastic = true, attracting = true;  // class B: γ = 0 and G_ij ≤ 0
  double worst = 0;
  int first = 0, second = 0;
  for (std::size_t i = 0; i < members.size(); ++i) {
    plastic = plastic && system_->restitution()(members[i]) == 0;
    for (std::size_t j = 0; j < i; ++j) {
      const bool counts =
          transition_.activated.Contains(members[i]) || transition_.activated.Contains(members[j]);
      const double coupling = G(i, j) / std::sqrt(G(i, i) * G(j, j));
      if (!counts || std::abs(coupling) <= kOrthogonal) continue;
      decoupled_ = false;
      attracting = attracting && coupling < 0;
      if (std::abs(coupling) > std::abs(worst)) {
        worst = coupling;
        first = members[j];
        second = members[i];
      }
    }
  }
  if (decoupled_ || (plastic && attracting)) return;
  outcomes_ = ListOrderOutcomes(dynamics_.get(), transition_);
  const std::vector<std::string>& names = system_->description().constraints;
  std::ostringstream message;
  message << "at t = " << transition_.t << " s the simultaneous contacts '" << names[first]
          << "' and '" << names[second]
          << "' are not orthogonal in the kinetic metric (normalized G_ij = " << worst
          << "): the order of impacts decides the outcome, which is discontinuous here";
  status_ = {Outcome::kDiscontinuous, message.str()};
}

const EventMap::Stage& EventMap::Activate(ContactMode activated, int i, const Matrix** reset) const {
  const Stage& stage = StageAt(activated);
  const ContactMode next = activated.With(i);
  const auto known_reset = resets_.find({activated, i});
  const auto known_stage = stages_.find(next);
  if (known_reset != resets_.end() && known_stage != stages_.end()) {
    *reset = &known_reset->second;
    return known_stage->second;
  }
  // Contacts that persist rest before and after this impact; those that have bounced take no part.
  const ContactMode touching = (stage.mode | (transition_.mode_before & activated)).With(i);
  const ImpactResult impact = SolveImpact(*system_, q_, stage.v, touching);
  const Vector normal_velocity = jacobian_ * impact.v_plus;
  const double rest = kRest * (1 + (jacobian_ * stage.v).cwiseAbs().maxCoeff());
  ContactMode persisting;
  for (int j : touching) {
    if (j != i && std::abs(normal_velocity(j)) <= rest) persisting.Insert(j);
  }
  if (known_reset == resets_.end()) {
    resets_[{activated, i}] =
        ImpactJacobian(*system_, q_, stage.v, impact, persisting.With(i), persisting);
  }
  *reset = &resets_[{activated, i}];
  if (known_stage != stages_.end()) return known_stage->second;

  Stage after;
  after.v = impact.v_plus;
  if (next == transition_.activated) {
    after.mode = transition_.mode_after;
  } else {
    ContactMode candidates;
    for (int j : transition_.mode_before | next) {
      const bool bounced = next.Contains(j) && system_->restitution()(j) > 0;
      if (!bounced && std::abs(normal_velocity(j)) <= rest) candidates.Insert(j);
    }
    after.mode = SelectContactMode(dynamics_.get(), State(after.v), candidates, 0);
  }
  after.field = dynamics_->Field(State(after.v), after.mode);
  return stages_[next] = after;
}

double EventMap::TimeTo(int i, const Stage& stage, const Vector& w) const {
  return -jacobian_.row(i).dot(w.head(q_.size())) / jacobian_.row(i).dot(stage.v);
}

Eigen::RowVectorXd EventMap::TimeRow(int i, const Stage& stage) const {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(2 * q_.size());
  row.head(q_.size()) = -jacobian_.row(i) / jacobian_.row(i).dot(stage.v);
  return row;
}

Vector EventMap::operator()(const VectorRef& direction) const {
  Vector w = direction;
  ContactMode S;
  double elapsed = 0;
  const Stage* stage = &StageAt(S);
  while (S != transition_.activated) {
    int next = -1;
    double earliest = std::numeric_limits<double>::infinity();
    for (int i : transition_.activated - S) {
      const double tau = TimeTo(i, *stage, w);
      if (tau < earliest || next < 0) {
        earliest = tau;
        next = i;
      }
    }
    const Matrix* reset = nullptr;
    w += earliest * stage->field;
    elapsed += earliest;
    stage = &Activate(S, next, &reset);
    w = *reset * w;
    S.Insert(next);
  }
  return w - elapsed * stage->field;
}

std::vector<ContactMode> EventMap::PerturbedModes(const VectorRef& direction) const {
  const int d = system_->dof();
  Vector w = direction;
  ContactMode S, pending = transition_.vanishing, mode = transition_.mode_before;
  std::vector<ContactMode> modes;
  const Stage* stage = &StageAt(S);
  double last = -std::numeric_limits<double>::infinity();
  double elapsed = 0;
  while (S != transition_.activated || !(pending & mode).Empty()) {
    // The earliest of the activations left and of the releases left, in the present mode.
    dynamics_->Differentiate(State(stage->v), mode);
    const Matrix force_gradient = dynamics_->force_jacobian();
    const Vector field = dynamics_->Field(State(stage->v), mode);
    int next = -1;
    double earliest = std::numeric_limits<double>::infinity();
    for (int i : (transition_.activated - S) | (pending & mode)) {
      const double tau = pending.Contains(i)
                             ? -force_gradient.row(i).dot(w) / force_gradient.row(i).dot(field)
                             : TimeTo(i, *stage, w);
      if (tau < earliest || next < 0) {
        earliest = tau;
        next = i;
      }
    }
    w += earliest * field;
    elapsed += earliest;
    if (pending.Contains(next)) {
      pending.Erase(next);
      mode.Erase(next);
    } else {
      const Matrix* reset = nullptr;
      stage = &Activate(S, next, &reset);
      w = *reset * w;
      S.Insert(next);
      const Vector normal_velocity = jacobian_ * stage->v;
      const double rest = kRest * (1 + (jacobian_ * StageAt({}).v).cwiseAbs().maxCoeff());
      ContactMode held;
      for (int j : pending & mode) {
        if (std::abs(normal_velocity(j)) <= rest) held.Insert(j);
      }
      mode = stage->mode | held;
    }
    const bool tied = !modes.empty() &&
                      elapsed - last <= kTie * (1 + direction.head(d).cwiseAbs().maxCoeff());
    if (tied) {
      modes.back() = mode;
    } else {
      modes.push_back(mode);
    }
    last = elapsed;
  }
  return modes;
}

Matrix EventMap::Selection(const std::vector<int>& order) const {
  const int n = 2 * static_cast<int>(q_.size());
  Matrix product = Matrix::Identity(n, n);
  ContactMode S;
  const Stage* stage = &StageAt(S);
  for (int i : order) {
    // Ξ_i = DR + (F⁺ − DR F⁻) Dh / (Dh F⁻), and the row of τ is −Dh / (Dh F⁻).
    const Eigen::RowVectorXd time = TimeRow(i, *stage);
    const Vector before = stage->field;
    const Matrix* reset = nullptr;
    stage = &Activate(S, i, &reset);
    const Matrix saltation = *reset + (*reset * before - stage->field) * time;
    product = S.Empty() ? saltation : saltation * product;
    S.Insert(i);
  }
  return product;
}

Matrix EventMap::Cone(const std::vector<int>& order) const {
  const int n = 2 * static_cast<int>(q_.size()), m = static_cast<int>(order.size());
  std::vector<Eigen::RowVectorXd> rows;
  Matrix carried = Matrix::Identity(n, n);  // w at this stage, moved to the time of the last event
  ContactMode S;
  const Stage* stage = &StageAt(S);
  for (int k = 0; k + 1 < m; ++k) {
    const Eigen::RowVectorXd first = TimeRow(order[k], *stage);
    const int last = decoupled_ ? k + 1 : m - 1;
    for (int l = k + 1; l <= last; ++l) {
      const Eigen::RowVectorXd row = (TimeRow(order[l], *stage) - first) * carried;
      if (row.norm() > 0) rows.push_back(row / row.norm());
    }
    const Vector field = stage->field;
    const Matrix* reset = nullptr;
    stage = &Activate(S, order[k], &reset);
    carried = *reset * (carried + field * (first * carried));
    S.Insert(order[k]);
  }
  Matrix cone(rows.size(), n);
  for (std::size_t r = 0; r < rows.size(); ++r) cone.row(r) = rows[r];
  return cone;
}

std::vector<ContactMode> EventMap::Modes(const std::vector<int>& order) const {
  std::vector<ContactMode> modes;
  ContactMode S;
  for (int i : order) {
    const Matrix* reset = nullptr;
    modes.push_back(Activate(S, i, &reset).mode);
    S.Insert(i);
  }
  if (modes.empty()) modes.push_back(transition_.mode_after);
  return modes;
}

PiecewiseLinearMap EventMap::Pieces(int max_activations) const {
  const int m = num_activations();
  if (m > max_activations) {
    std::ostringstream message;
    message << m << " simultaneous activations at t = " << transition_.t << " s have " << m
            << "! pieces: all pieces are given for at most " << max_activations
            << " (max_activations_for_pieces); directions are not limited";
    throw std::length_error(message.str());
  }
  const std::vector<std::string>& names = system_->description().constraints;
  std::vector<LinearPiece> pieces;
  std::vector<int> order = activated_;
  do {
    LinearPiece piece;
    piece.matrix = Selection(order);
    piece.cone = Cone(order);
    std::vector<std::string> word;
    for (int i : order) word.push_back(names[i]);
    if (m > 0) piece.omega.push_back(word);
    piece.eta.push_back(transition_.mode_before.ToString(names));
    for (ContactMode mode : Modes(order)) piece.eta.push_back(mode.ToString(names));
    pieces.push_back(std::move(piece));
  } while (std::next_permutation(order.begin(), order.end()));
  return PiecewiseLinearMap(std::move(pieces));
}

bool EventMap::IsDifferentiable(double tolerance) const {
  const int m = num_activations();
  if (!status_.ok() || m > kMaxModularActivations) return false;
  if (m < 2) return true;
  // F̂_S over subsets S of {0, …, m−1}: F_S carried through the resets of the activations not in S.
  const std::uint64_t all = (std::uint64_t{1} << m) - 1;
  const auto set_of = [&](std::uint64_t subset) {
    ContactMode S;
    for (int k = 0; k < m; ++k) {
      if (subset >> k & 1) S.Insert(activated_[k]);
    }
    return S;
  };
  const Matrix* reset = nullptr;
  for (std::uint64_t subset = 1; subset <= all; ++subset) {  // make every stage
    const int top = 63 - __builtin_clzll(subset);
    Activate(set_of(subset & ~(std::uint64_t{1} << top)), activated_[top], &reset);
  }
  std::vector<Vector> carried(all + 1);
  double scale = 1;
  for (std::uint64_t subset = 0; subset <= all; ++subset) {
    ContactMode S = set_of(subset);
    carried[subset] = StageAt(S).field;
    for (int i : transition_.activated - S) {
      Activate(S, i, &reset);
      carried[subset] = *reset * carried[subset];
      S.Insert(i);
    }
    scale = std::max(scale, carried[subset].cwiseAbs().maxCoeff());
  }
  for (std::uint64_t subset = 0; subset <= all; ++subset) {
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < i; ++j) {
        const std::uint64_t bi = std::uint64_t{1} << i, bj = std::uint64_t{1} << j;
        if (subset & (bi | bj)) continue;
        const Vector defect = carried[subset | bi | bj] - carried[subset | bi] -
                              carried[subset | bj] + carried[subset];
        if (defect.cwiseAbs().maxCoeff() > tolerance * scale) return false;
      }
    }
  }
  return true;
}

}  // namespace contact_flow
