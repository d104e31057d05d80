// SPDX-License-Identifier: BSD-3-Clause
#include "frictional_walk.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "cluster_walk.h"
#include "contact_flow/budget.h"
#include "frictional_reset.h"
#include "src/flow/force_slack.h"

namespace contact_flow {
namespace {

/// A direction does not move a slip, relative to the sizes of D(T v) and w.
constexpr double kUnmoved = 1e-11;
constexpr double kRounded = 1e-14;   // of the largest entries: what the arcs before leave of zeros
constexpr double kSameTime = 1e-12;  // then touchdowns come first, relative
constexpr double kSameInstant = 1e-6;  // what parts instants of dependent rows by less is rounding
constexpr int kRoundsForEach = 4;      // contact, at most

}  // namespace

FrictionalWalk::FrictionalWalk(ContactDynamics* dynamics, const Transition& transition,
                               const std::vector<Vector>& inputs, const VectorRef& w,
                               const VectorRef& dt)
    : dynamics_(*dynamics),
      system_(dynamics->system()),
      transition_(transition),
      inputs_(inputs),
      first_input_(dynamics->u()),
      guards_(system_),
      d_(system_.dof()),
      size_(2 * d_ + dynamics->num_variables()),
      width_(size_ + static_cast<int>(inputs.size())),
      w_((Vector(width_) << w, dt).finished()),
      sizes_(w_.cwiseAbs()),
      point_(dynamics, transition),
      mode_(transition.mode_before),
      pending_(transition.activated) {
  path_.matrix = Matrix::Identity(size_, width_);
  path_.times.resize(0, width_);
  passed_ = Vector::Zero(size_);
  still_ = mode_.Sticking();
  for (int g : transition.guards) {
    if (guards_.OfSlips(mode_).Contains(g)) still_.Insert(guards_.ConstraintOf(g));
  }
  releasing_ = transition.vanishing;
  bursting_ = Bursting();
  slack_ = ForceSlack(&dynamics_, transition);
  SettleSticking();
}

FrictionalPath FrictionalWalk::Take() {
  const int limit = kRoundsForEach * (system_.num_constraints() + 1);
  for (int round = 0; Next(); ++round) {
    AskBudget();
    if (round < limit) continue;
    throw std::domain_error("events of a perturbed run follow each other without end");
  }
  StopLast();
  FinishWord();
  AddBounces();
  path_.cone = Rows();
  path_.v_plus = point_.v();
  const Eigen::Index changes = width_ - size_;
  path_.by_instants = path_.matrix.rightCols(changes);
  path_.times_by_instants = path_.times.rightCols(changes);
  path_.matrix.conservativeResize(Eigen::NoChange, size_);
  path_.times.conservativeResize(Eigen::NoChange, size_);
  return path_;
}

double FrictionalWalk::MovesRow(int k) const {
  const auto row = point_.rate_jacobian().row(k);
  const double moved = row.dot(path_.matrix * w_);
  const double known = kUnmoved * row.cwiseAbs().dot(sizes_.head(size_));
  const double rounding = kRounded * row.cwiseAbs().maxCoeff() * sizes_.maxCoeff();
  return std::abs(moved) <= std::max(known, rounding) ? 0 : moved;
}

void FrictionalWalk::Decide(Eigen::RowVectorXd row, const Eigen::RowVectorXd& sizes) {
  for (Eigen::Index c = 0; c < row.size(); ++c) {
    if (std::abs(row(c)) <= kUnmoved * sizes(c)) row(c) = 0;
  }
  if (!row.isZero(0)) decisions_.push_back(row);
}

Matrix FrictionalWalk::Rows() const {
  Matrix rows(static_cast<Eigen::Index>(decisions_.size()), size_);
  Eigen::Index count = 0;
  for (const Eigen::RowVectorXd& decision : decisions_) {
    const double norm = decision.head(size_).stableNorm();
    if (norm > 0) rows.row(count++) = decision.head(size_) / norm;
  }
  return rows.topRows(count);
}

void FrictionalWalk::SettleSticking() {
  ConstraintSet moved;
  for (int i : mode_.Sticking()) {
    const Friction& friction = system_.friction()[i];
    const Vector now = path_.matrix * w_;
    const auto rows = point_.rate_jacobian().middleRows(friction.row, friction.dimension);
    const double size = (rows.cwiseAbs() * now.cwiseAbs()).norm();
    if ((rows * now).norm() > 1e-9 * size) moved.Insert(i);
  }
  if (moved.Empty()) return;
  path_.matrix =
      StopProjection(&dynamics_, point_.x(), mode_, mode_.Sticking(), point_.rate_jacobian()) *
      path_.matrix;
}

ConstraintSet FrictionalWalk::Bursting() const {
  ConstraintSet bursting;
  for (int g : transition_.guards) {
    const int i = guards_.ConstraintOf(g);
    // Beside one that begins to slip here, the instant depends on which is first.
    const bool lets_go = !transition_.mode_after.Contains(i);
    if (guards_.KindOf(g, mode_) != GuardKind::kCone || !lets_go) return {};
    bursting.Insert(i);
  }
  const bool alone = transition_.activated.Empty() && transition_.grazed.Empty() && inputs_.empty();
  return alone ? bursting : ConstraintSet();
}

std::vector<WalkGuard> FrictionalWalk::GuardsHere() {
  ContactsAhead ahead{pending_, {}, releasing_, bursting_};
  for (int i : mode_.SlippingInPlane()) {
    if (Still(i)) ahead.stopping.Insert(i);
  }
  return GuardsAhead(&dynamics_, point_, mode_, ahead);
}

Eigen::RowVectorXd FrictionalWalk::TimeOf(const WalkGuard& guard) const {
  return -(guard.gradient * path_.matrix) / guard.rate;
}

bool FrictionalWalk::Next() {
  const Vector free = dynamics_.Field(point_.x(), ContactMode());
  const Vector field = FieldHere();
  std::vector<WalkGuard> guards = GuardsHere();
  std::vector<Eigen::RowVectorXd> times;
  for (const WalkGuard& c : guards) times.push_back(TimeOf(c));
  if (changes_ < inputs_.size()) {
    const auto change = static_cast<int>(changes_);
    guards.push_back({WalkGuard::Kind::kInput, system_.num_constraints() + change, {}, 1});
    times.push_back(Eigen::RowVectorXd::Unit(width_, size_ + change));
  }
  if (guards.empty()) return false;
  std::size_t first = 0;
  for (std::size_t k = 1; k < guards.size(); ++k) {
    const double later = (times[k] - times[first]).dot(w_);
    if (later < -kSameTime * times[first].cwiseAbs().dot(sizes_)) first = k;
  }
  CheckOnset(SlippedBefore());
  const WalkGuard& c = guards[first];
  const Eigen::RowVectorXd tau = times[first];
  ConstraintSet along = Along(c);
  for (int j : PartedFrom(c, along, tau, field)) Part(c, j, &along);
  for (std::size_t k = 0; k < times.size(); ++k) {
    const bool same = guards[k].kind == c.kind && along.Contains(guards[k].constraint);
    if (k == first || same) continue;
    Decide(times[k] - times[first], times[k].cwiseAbs() + times[first].cwiseAbs());
  }
  const double moved = std::abs(tau.dot(w_));
  passed_ += moved * (field.cwiseAbs() + free.cwiseAbs());
  path_.matrix += field * tau;
  sizes_.head(size_) += moved * field.cwiseAbs();
  Pass(c, along);
  BeginInRun();
  CheckDropped();
  const Vector after = FieldHere();
  path_.matrix -= after * tau;
  sizes_.head(size_) += moved * after.cwiseAbs();
  path_.guards.push_back(c.constraint);
  path_.modes.push_back(mode_);
  path_.velocities.push_back(point_.v());
  path_.times.conservativeResize(path_.times.rows() + 1, Eigen::NoChange);
  path_.times.bottomRows(1) = tau;
  return true;
}

ConstraintSet FrictionalWalk::PartedFrom(const WalkGuard& c, ConstraintSet along,
                                         const Eigen::RowVectorXd& tau, const Vector& field) const {
  ConstraintSet parted;
  const double delay = tau.dot(w_);
  const Vector now = path_.matrix * w_ + delay * field;
  const Vector sizes = sizes_.head(size_) + std::abs(delay) * field.cwiseAbs();
  const bool lands = c.kind == WalkGuard::Kind::kTouchdown;
  for (int j : along) {
    const Friction& friction = system_.friction()[j];
    const Matrix rows = lands ? Matrix(point_.gap_jacobian().row(j))
                              : point_.rate_jacobian().middleRows(friction.row, friction.dimension);
    const Vector moved = (rows * now).cwiseAbs(), known = kSameInstant * (rows.cwiseAbs() * sizes);
    if ((moved.array() > known.array()).any()) parted.Insert(j);
  }
  return parted;
}

void FrictionalWalk::Part(const WalkGuard& c, int later, ConstraintSet* along) {
  const bool lands = c.kind == WalkGuard::Kind::kTouchdown;
  if (lands || !mode_.Sticking().Empty() || !Still(later)) {
    const auto& names = system_.description().constraints;
    throw std::domain_error("a perturbed run parts the " +
                            std::string(lands ? "touchdowns" : "stops") + " of contacts '" +
                            names[c.constraint] + "' and '" + names[later] +
                            "', whose rows depend on each other: the later one is not followed");
  }
  along->Erase(later);
  parted_ = true;
}

void FrictionalWalk::Pass(const WalkGuard& guard, ConstraintSet along) {
  const int i = guard.constraint;
  const ConstraintSet never = NeverSlipping(system_, releasing_);
  just_stopped_ = ConstraintSet();
  switch (guard.kind) {
    case WalkGuard::Kind::kTouchdown:
      Land(i, along);
      return SelectNext();
    case WalkGuard::Kind::kStop:
      just_stopped_ = along.With(i);
      return SelectNext();
    case WalkGuard::Kind::kOnset:
      return SelectNext(never);
    case WalkGuard::Kind::kRelease:
      releasing_.Erase(i);
      (never.Contains(i) ? released_ : hovering_).Insert(i);
      if (never.Contains(i)) return SelectNext();
      mode_.Erase(i);  // from zero: all other forces stay as they are
      return;
    case WalkGuard::Kind::kInput:
      dynamics_.SetInput(inputs_[changes_++]);
      point_.MoveTo(point_.x());  // other forces
      SelectNext();
      CheckOnset();
  }
}

FrictionalPath WalkThrough(ContactDynamics* dynamics, const Transition& transition,
                           const std::vector<Vector>& inputs, const VectorRef& w,
                           const VectorRef& dt) {
  return FrictionalWalk(dynamics, transition, inputs, w, dt).Take();
}

}  // namespace contact_flow
