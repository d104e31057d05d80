// SPDX-License-Identifier: BSD-3-Clause
#include "frictional_walk.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/word_selection.h"
#include "frictional_reset.h"
#include "src/dynamics/implied_contacts.h"
#include "src/flow/force_slack.h"
#include "walk_guards.h"
#include "walk_point.h"

namespace contact_flow {
namespace {

/// A direction does not move a slip, relative to the sizes of D(T v) and w.
constexpr double kUnmoved = 1e-11;
constexpr double kRounded = 1e-15;  // of the largest entries: what the arcs before leave of zeros
constexpr double kBorder = 1e-9;
constexpr double kHovers = 1e-7;     // an acceleration that vanishes, relative
constexpr double kSameTime = 1e-12;  // then touchdowns come first, relative
constexpr int kRoundsForEach = 4;    // contact, at most

/// Along one direction (w, δt); everything is carried as matrices, so that the result holds on the
/// whole cone of the decisions that it makes.
class FrictionalWalk {
 public:
  FrictionalWalk(ContactDynamics* dynamics, const Transition& transition,
                 const std::vector<Vector>& inputs, const VectorRef& w, const VectorRef& dt)
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
    path_.margin = std::numeric_limits<double>::infinity();
    still_ = mode_.Sticking();
    for (int g : transition.guards) {
      if (guards_.OfSlips(mode_).Contains(g)) still_.Insert(guards_.ConstraintOf(g));
    }
    releasing_ = transition.vanishing;
    slack_ = ForceSlack(&dynamics_, transition);
    SettleSticking();
  }

  ~FrictionalWalk() { dynamics_.SetInput(first_input_); }
  FrictionalWalk(const FrictionalWalk&) = delete;
  FrictionalWalk& operator=(const FrictionalWalk&) = delete;

  FrictionalPath Take() {
    const int limit = kRoundsForEach * (system_.num_constraints() + 1);
    for (int round = 0; Next(); ++round) {
      AskBudget();
      if (round < limit) continue;
      throw std::domain_error("events of a perturbed run follow each other without end");
    }
    StopInSpace();
    FinishWord();
    path_.cone = Rows();
    path_.v_plus = point_.v();
    const Eigen::Index changes = width_ - size_;
    path_.by_instants = path_.matrix.rightCols(changes);
    path_.times_by_instants = path_.times.rightCols(changes);
    path_.matrix.conservativeResize(Eigen::NoChange, size_);
    path_.times.conservativeResize(Eigen::NoChange, size_);
    return path_;
  }

 private:
  /// Whether the slip of contact i vanishes at the base point.
  bool Still(int i) const { return still_.Contains(i) || point_.SlipVanishes(i); }
  /// D(T v) w of contact i in the plane, or 0 where w does not move it.
  double Moves(int i) const {
    const auto row = point_.rate_jacobian().row(system_.friction()[i].row);
    const double moved = row.dot(path_.matrix * w_);
    const double known = kUnmoved * row.cwiseAbs().dot(sizes_.head(size_));
    const double rounding = kRounded * row.cwiseAbs().maxCoeff() * sizes_.maxCoeff();
    return std::abs(moved) <= std::max(known, rounding) ? 0 : moved;
  }
  /// w lies on the positive side of `row`, whose entries are sums of terms of this size.
  void Decide(const Eigen::RowVectorXd& row, double size) {
    const double norm = row.norm();
    if (!(norm > kUnmoved * size)) return;
    decisions_.push_back(row / norm);
    path_.margin = std::min(path_.margin, decisions_.back().dot(w_) / w_.norm());
  }
  /// The decisions among directions w at fixed instants of the input.
  Matrix Rows() const {
    Matrix rows(static_cast<Eigen::Index>(decisions_.size()), size_);
    Eigen::Index count = 0;
    for (const Eigen::RowVectorXd& decision : decisions_) {
      const double norm = decision.head(size_).norm();
      if (norm > kUnmoved) rows.row(count++) = decision.head(size_) / norm;
    }
    return rows.topRows(count);
  }

  /// Contacts that stick where the cluster begins, and that w moves: by the projection (F7).
  void SettleSticking() {
    ContactMode moved;
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

  std::vector<WalkGuard> GuardsHere() {
    ContactsAhead ahead{pending_, {}, releasing_};
    for (int i : mode_.SlippingInPlane()) {
      if (Still(i)) ahead.stopping.Insert(i);
    }
    return GuardsAhead(&dynamics_, point_, mode_, ahead);
  }
  /// The first-order instant of a guard as a row by (w, δt).
  Eigen::RowVectorXd TimeOf(const WalkGuard& guard) const {
    return -(guard.gradient * path_.matrix) / guard.rate;
  }

  /// The guard that vanishes next; false when none is left.
  bool Next() {
    const Vector field = dynamics_.Field(point_.x(), mode_);
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
    const WalkGuard& c = guards[first];
    const ContactMode along = Along(c);
    for (std::size_t k = 0; k < times.size(); ++k) {
      const bool same = guards[k].kind == c.kind && along.Contains(guards[k].constraint);
      if (k == first || same) continue;
      Decide(times[k] - times[first], times[k].norm() + times[first].norm());
    }
    const Eigen::RowVectorXd tau = times[first];
    const double moved = std::abs(tau.dot(w_));
    path_.matrix += field * tau;
    sizes_.head(size_) += moved * field.cwiseAbs();
    Pass(c, along);
    CheckDropped();
    const Vector after = dynamics_.Field(point_.x(), mode_);
    path_.matrix -= after * tau;
    sizes_.head(size_) += moved * after.cwiseAbs();
    path_.guards.push_back(c.constraint);
    path_.modes.push_back(mode_);
    path_.times.conservativeResize(path_.times.rows() + 1, Eigen::NoChange);
    path_.times.bottomRows(1) = tau;
    return true;
  }

  void Pass(const WalkGuard& guard, ContactMode along) {
    const int i = guard.constraint;
    const ContactMode never = NeverSlipping(system_, releasing_);
    just_stopped_ = ContactMode();
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

  /// A slip that begins in space has no direction among these events.
  void CheckOnset() const {
    for (int i : mode_) {
      const bool in_space = mode_.LetterOf(i) == Letter::kSlip && system_.friction()[i].dimension == 2;
      if (!in_space || system_.friction()[i].coefficient == 0 || !point_.SlipVanishes(i)) continue;
      throw std::domain_error("a perturbed run begins to slip in space at contact '" +
                              system_.description().constraints[i] + "'");
    }
  }

  bool IsPulledBack(int i, ContactMode mode) const {
    const double back = -point_.rate_jacobian().row(i).dot(dynamics_.Field(point_.x(), mode));
    return back > kHovers * point_.acceleration();
  }

  /// Contacts that let go among these events with an acceleration, and that a later one pulls back
  /// touch again, with a speed of first order.
  void CheckDropped() {
    dropped_ = dropped_ - mode_;
    for (int i : (dropped_ | released_) - pending_) {
      if (point_.Leaves(i) != 0 || !IsPulledBack(i, mode_)) continue;
      throw std::domain_error("a perturbed run lets go of contact '" +
                              system_.description().constraints[i] + "', which is pulled back");
    }
  }

  /// Contacts of the same body that an event brings along: what lands, or stops, with it.
  ContactMode Along(const WalkGuard& c) const {
    if (c.kind == WalkGuard::Kind::kTouchdown) {
      return ImpliedClosed(system_, point_.x(), mode_.Members().With(c.constraint),
                           pending_.Without(c.constraint));
    }
    if (c.kind != WalkGuard::Kind::kStop) return {};
    return ImpliedStill(system_, point_.x(), mode_.Members(), mode_.Sticking().With(c.constraint));
  }

  void Land(int i, ContactMode along) {
    pending_ = pending_ - along.With(i);
    const ContactMode touching = mode_.Members().With(i) | along;
    released_ = released_ - touching;
    const FrictionalReset reset(dynamics_, point_.x(), touching, i, mode_, transition_.mode_after);
    const FrictionalReset::Branch& branch =
        reset.Choose(path_.matrix * w_, sizes_, [&](const Eigen::RowVectorXd& row) {
          Decide(row * path_.matrix, row.norm() * path_.matrix.norm());
        });
    path_.matrix = branch.jacobian * path_.matrix;
    sizes_.head(size_) = (branch.jacobian.cwiseAbs() * sizes_.head(size_)).eval();
    Vector struck = point_.x();
    struck.tail(d_) = reset.v_plus();
    point_.MoveTo(struck);
    still_ = (still_ - branch.word) | branch.word.Sticking();
    landed_ = touching;
    for (int j : still_ - branch.word) {  // an impact elsewhere may throw it along
      if (!point_.SlipVanishes(j)) still_.Erase(j);
    }
    // What has let go before, by less than to first order, and is driven back is hit at once.
    for (int j : transition_.mode_before.Members() - touching - pending_) {
      if (point_.Leaves(j) < 0) pending_.Insert(j);
      if (point_.Leaves(j) != 0) hovering_.Erase(j);
    }
    lifted_ = ContactMode();
    for (int j : touching) {
      const bool bounces = along.With(i).Contains(j) && system_.restitution()(j) > 0;
      const bool free = bounces || !branch.word.Contains(j);
      if (free && point_.Leaves(j) > 0) lifted_.Insert(j);
    }
  }

  /// The word at the base point for runs perturbed along w, in which those of `free` may let go.
  void SelectNext(ContactMode free = {}) {
    TouchingContacts contacts;
    contacts.slack = slack_;
    const ContactMode touching = (landed_.Empty() ? mode_ : landed_).Members();
    const ContactMode closed = (touching | hovering_) - released_;
    for (int i : closed) {
      if (lifted_.Contains(i)) continue;
      const Friction& friction = system_.friction()[i];
      if (friction.dimension == 0 || friction.coefficient == 0) {
        contacts.slipping.Insert(i);
      } else if (std::isinf(friction.coefficient)) {
        contacts.still.Insert(i);
      } else if (friction.dimension == 2) {
        (point_.SlipVanishes(i) ? contacts.still : contacts.slipping).Insert(i);
      } else if (!Still(i)) {
        contacts.slipping.Set(
            i, point_.rate()(friction.row) > 0 ? Letter::kForward : Letter::kBackward);
      } else if (const double moved = just_stopped_.Contains(i) ? 0 : Moves(i); moved != 0) {
        const double sign = moved > 0 ? 1 : -1;
        Decide(sign * point_.rate_jacobian().row(friction.row) * path_.matrix, 0);
        contacts.slipping.Set(i, moved > 0 ? Letter::kForward : Letter::kBackward);
      } else {
        contacts.still.Insert(i);
      }
    }
    mode_ = SelectWord(&dynamics_, point_.x(), contacts, kBorder);
    released_ = released_ | (free - mode_).Members();
    HoldForceless(contacts, ContactMode(closed & releasing_) - lifted_ - (free - mode_));
    Drop(closed - mode_ - lifted_);
    landed_ = lifted_ = ContactMode();
  }

  /// What is to let go, and has no force at the base point, holds until its own release: an event
  /// elsewhere may make its force jump, up or away. What has let go stays away.
  void HoldForceless(const TouchingContacts& contacts, ContactMode held) {
    ContactMode holding = mode_;
    for (int i : held) {
      const bool slips = contacts.slipping.Contains(i);
      holding.Set(i, slips ? contacts.slipping.LetterOf(i) : Letter::kStick);
    }
    releasing_ = point_.Forceless(holding, held);
    for (int i : releasing_) mode_.Set(i, holding.LetterOf(i));
    mode_ = mode_ - point_.Forceless(mode_, (mode_ & hovering_).Members());
    hovering_ = hovering_ - mode_;
  }

  /// Contacts that the word lets go: with an acceleration, or without, so that whatever pulls them
  /// back finds them where they were.
  void Drop(ContactMode gone) {
    if (gone.Empty()) return;
    const Vector field = dynamics_.Field(point_.x(), mode_);
    for (int i : gone) {
      const double acceleration = point_.rate_jacobian().row(i).dot(field);
      const bool hovers = acceleration <= kHovers * point_.acceleration();
      (hovers ? hovering_ : dropped_).Insert(i);
      if (!hovers) hovering_.Erase(i);
    }
  }

  /// Slips in space that end at the base point, all at once: their order does not matter.
  void StopInSpace() {
    const ContactMode after = transition_.mode_after;
    ContactMode stopped;
    for (int i : transition_.mode_before) {
      const bool in_space = system_.friction()[i].dimension == 2;
      if (in_space && mode_.LetterOf(i) == Letter::kSlip && after.LetterOf(i) == Letter::kStick) {
        stopped.Insert(i);
      }
    }
    if (stopped.Empty()) return;
    point_.MoveTo(transition_.x_plus);
    path_.matrix = StopProjection(&dynamics_, point_.x(), after, stopped, point_.rate_jacobian()) *
                   path_.matrix;
    mode_ = after;
    path_.modes.push_back(after);
  }

  /// Guards that are identities change the word alone.
  void FinishWord() {
    const ContactMode after = transition_.mode_after;
    if (mode_ == after) return;
    path_.modes.push_back(after);
  }

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Transition& transition_;
  const std::vector<Vector>& inputs_;  // after each change
  const Vector first_input_;
  const Guards guards_;
  const int d_, size_;  // 2d+k
  const int width_;     // … and the changes of the input: columns of what is carried
  const Vector w_;
  Vector sizes_;  // of the terms that the entries of the tangent, and δt, are sums of [2d+k+c]
  WalkPoint point_;
  Vector slack_;  // of forces that vanish, by constraint
  ContactMode mode_;
  ContactMode pending_;          // touchdowns to come
  ContactMode releasing_;        // forces that are to vanish
  ContactMode released_;         // without slip
  ContactMode hovering_;         // let go without acceleration
  ContactMode dropped_;          // let go with one
  ContactMode landed_, lifted_;  // by the last touchdown: what took part, and what left
  ContactMode still_;            // known to have no slip at the base point
  ContactMode just_stopped_;
  std::size_t changes_ = 0;  // of the input, so far
  std::vector<Eigen::RowVectorXd> decisions_;
  FrictionalPath path_;
};

}  // namespace

FrictionalPath WalkThrough(ContactDynamics* dynamics, const Transition& transition,
                           const std::vector<Vector>& inputs, const VectorRef& w,
                           const VectorRef& dt) {
  return FrictionalWalk(dynamics, transition, inputs, w, dt).Take();
}

}  // namespace contact_flow
