// SPDX-License-Identifier: BSD-3-Clause
// The words on the way through a cluster with friction.
#include <cmath>
#include <map>
#include <stdexcept>

#include "bounce_to_rest.h"
#include "cluster_walk.h"
#include "frictional_reset.h"
#include "rest_reset.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/slips_in_space.h"
#include "src/flow/slip_onset.h"

namespace contact_flow {
namespace {

constexpr double kBorder = 1e-9;
constexpr double kHovers = 1e-7;     // an acceleration that vanishes, relative
constexpr double kBegun = 1e-8;      // a slip that begins, relative: more than counts as none
constexpr double kFaster = 10;       // slips of which directions are known to rounding
constexpr double kSameOnset = 1e-5;  // directions of slips that begin
constexpr double kSameField = 1e-6;  // identities change the field by what events are located to

}  // namespace

void FrictionalWalk::CheckOnset(ConstraintSet except) const {
  for (int i : mode_.Members() - except) {
    const bool in_space =
        mode_.LetterOf(i) == Letter::kSlip && system_.friction()[i].dimension == 2;
    if (!in_space || system_.friction()[i].coefficient == 0 || !point_.SlipVanishes(i)) continue;
    throw std::domain_error("a perturbed run begins to slip in space at contact '" +
                            system_.description().constraints[i] + "'");
  }
}

void FrictionalWalk::BeginInRun() {
  for (const auto& slip : begun_) {
    if (mode_.LetterOf(slip.first) != Letter::kSlip) ThrowTurned(slip.first);
  }
  const bool last = mode_ == transition_.mode_after && pending_.Empty();
  ConstraintSet begins;
  for (int i : SlipsInSpace(system_, mode_)) {
    if (point_.SlipVanishes(i) || (last && begun_.count(i) > 0)) begins.Insert(i);
  }
  if (begins.Empty()) return;
  if (last) point_.MoveTo(transition_.x_plus);
  if (!last || !begun_.empty()) BeginHere(begins, last);
}

void FrictionalWalk::BeginHere(ConstraintSet begins, bool last) {
  if (!inputs_.empty()) return;
  TouchingContacts touching = Touching(false);
  touching.slipping = touching.slipping.Without(begins);
  touching.still = touching.still | begins;
  const std::map<int, Eigen::Vector2d> directions =
      OnsetDirections(&dynamics_, point_.x(), touching, mode_, begins, kBorder);
  for (const auto& [i, direction] : directions) {
    const auto before = begun_.find(i);
    const bool turns =
        before != begun_.end() && (before->second.normalized() - direction).norm() > kSameOnset;
    if (turns) ThrowTurned(i);
    begun_[i] = kBegun * point_.SizeOf(system_.friction()[i].row) * direction;
  }
  if (!last) point_.MoveTo(WithSlips(1));
}

void FrictionalWalk::ThrowTurned(int i) const {
  throw std::domain_error("a perturbed run begins to slip in space at contact '" +
                          system_.description().constraints[i] +
                          "', and slips otherwise, or not, behind another event");
}

Vector FrictionalWalk::WithSlips(double times) const {
  if (begun_.empty()) return point_.x();
  std::map<int, Eigen::Vector2d> onsets = begun_;
  for (auto& [i, onset] : onsets) onset *= times;
  Vector x = point_.x();
  MakeRest(system_, mode_, onsets, &x);
  return x;
}

/// By two states on the way into their directions, whose fields differ from it in their ratio.
Vector FrictionalWalk::FieldHere() {
  if (begun_.empty()) return dynamics_.Field(point_.x(), mode_);
  const auto field = [&](double times) { return dynamics_.Field(WithSlips(times), mode_); };
  return 2 * field(kFaster) - field(2 * kFaster);
}

bool FrictionalWalk::IsPulledBack(int i, ContactMode mode) const {
  const double back = -point_.rate_jacobian().row(i).dot(dynamics_.Field(point_.x(), mode));
  return back > kHovers * point_.acceleration();
}

void FrictionalWalk::CheckDropped() {
  dropped_ = dropped_ - mode_;
  for (int i : (dropped_ | released_) - pending_) {
    if (point_.Leaves(i) != 0 || !IsPulledBack(i, mode_)) continue;
    throw std::domain_error("a perturbed run lets go of contact '" +
                            system_.description().constraints[i] + "', which is pulled back");
  }
}

double FrictionalWalk::Moves(int i) const {
  const int row = system_.friction()[i].row;
  const double slip = MovesRow(row);
  const double gained = point_.rate_jacobian().row(row).cwiseAbs().dot(passed_);
  return std::abs(slip) <= kHovers * gained ? 0 : slip;
}

ConstraintSet FrictionalWalk::Along(const WalkGuard& c) const {
  if (c.kind == WalkGuard::Kind::kTouchdown) {
    return ImpliedClosed(system_, point_.x(), mode_.Members().With(c.constraint),
                         pending_.Without(c.constraint));
  }
  if (c.kind != WalkGuard::Kind::kStop) return {};
  return ImpliedStill(system_, point_.x(), mode_, mode_.Sticking().With(c.constraint));
}

void FrictionalWalk::Land(int i, ConstraintSet along) {
  pending_ = pending_ - along.With(i);
  const ConstraintSet touching = mode_.Members().With(i) | along;
  released_ = released_ - touching;
  const Vector x = WithSlips(0);  // which the event finds at the base point
  const FrictionalReset reset(dynamics_, x, touching, i, mode_, transition_);
  const FrictionalReset::Branch& branch = reset.Choose(
      path_.matrix * w_, sizes_, [&](const Eigen::RowVectorXd& row) { DecideAlong(row); });
  if (branch.bounce.size() > 0) {
    bounces_.push_back({i, branch.bounce_speed * path_.matrix, branch.bounce});
  }
  path_.matrix = branch.jacobian * path_.matrix;
  GrowSizes(branch.jacobian);
  Vector struck = x;
  struck.tail(d_) = reset.v_plus();
  const ContactMode rested = transition_.rested;
  if (!rested.Empty()) {
    const RestReset rest = ResetToRest(dynamics_, struck, rested);
    path_.matrix = rest.jacobian * path_.matrix;
    GrowSizes(rest.jacobian);
    struck.tail(d_) = rest.v_plus;
  }
  const ConstraintSet ending = EndingInSpace();
  point_.MoveTo(struck);
  for (int j : ending) {
    if (!point_.SlipVanishes(j)) ThrowStruck(j);
  }
  still_ = (still_ - branch.word) | branch.word.Sticking() | rested.Sticking();
  landed_ = touching;
  for (int j : still_ - branch.word - rested.Sticking()) {  // an impact elsewhere throws it along
    if (!point_.SlipVanishes(j)) still_.Erase(j);
  }
  // What has let go before, by less than to first order, and is driven back is hit at once.
  for (int j : transition_.mode_before - touching - pending_) {
    if (point_.Leaves(j) < 0) pending_.Insert(j);
    if (point_.Leaves(j) != 0) hovering_.Erase(j);
  }
  lifted_ = ConstraintSet();
  for (int j : touching) {
    const bool bounces = along.With(i).Contains(j) && system_.restitution()(j) > 0;
    const bool free = bounces || !branch.word.Contains(j);
    if (free && point_.Leaves(j) > 0) lifted_.Insert(j);
  }
  LandAgain((mode_.Members() | hovering_) - along.With(i) - branch.word - rested - lifted_);
}

void FrictionalWalk::LandAgain(ConstraintSet open) {
  ConstraintSet back;
  for (int j : open) {
    if (MovesRow(j) != 0) back.Insert(j);
  }
  if (back.Empty()) return;
  const ContactMode word = SelectWord(&dynamics_, point_.x(), Touching(false), kBorder);
  back = back & word;
  back = back - point_.Forceless(word, back);
  if (back.Empty()) return;
  const bool last = pending_.Empty() && changes_ == inputs_.size();
  for (int j : back) {
    const bool stays = last || transition_.mode_after.Contains(j);
    if (stays && system_.restitution()(j) < 1) continue;
    throw std::domain_error("a perturbed run lifts contact '" +
                            system_.description().constraints[j] +
                            (stays ? "', which bounces without coming to rest"
                                   : "', which is pressed back before it leaves"));
  }
  const Matrix landing =
      LandingProjection(&dynamics_, point_.x(), word, back, point_.rate_jacobian());
  path_.matrix = landing * path_.matrix;
  GrowSizes(landing);
}

void FrictionalWalk::AddBounces() {
  for (const Bounce& bounce : bounces_) {
    const Vector added = BounceToRest(&dynamics_, transition_, bounce.constraint, bounce.adds);
    if (added.isZero(0)) continue;
    if (bounces_.size() > 1 || transition_.activated.Size() > 1) {
      throw std::domain_error("depends on how contact '" +
                              system_.description().constraints[bounce.constraint] +
                              "', given a little restitution, bounces beside other touchdowns");
    }
    path_.matrix.middleRows(d_, d_) += added * bounce.speed;
  }
}

TouchingContacts FrictionalWalk::Touching(bool moved) {
  TouchingContacts contacts;
  contacts.slack = slack_;
  for (int i : Closed()) {
    if (lifted_.Contains(i)) continue;
    const Friction& friction = system_.friction()[i];
    if (friction.dimension == 0 || friction.coefficient == 0) {
      contacts.slipping.Insert(i);
    } else if (std::isinf(friction.coefficient)) {
      contacts.still.Insert(i);
    } else if (friction.dimension == 2) {
      if (point_.SlipVanishes(i)) {
        contacts.still.Insert(i);
      } else {
        contacts.slipping.Insert(i);
      }
    } else if (!Still(i)) {
      contacts.slipping.Set(i,
                            point_.rate()(friction.row) > 0 ? Letter::kForward : Letter::kBackward);
    } else if (const double slip = moved && !just_stopped_.Contains(i) ? Moves(i) : 0; slip != 0) {
      const double sign = slip > 0 ? 1 : -1;
      DecideAlong(sign * point_.rate_jacobian().row(friction.row));
      contacts.slipping.Set(i, slip > 0 ? Letter::kForward : Letter::kBackward);
    } else {
      contacts.still.Insert(i);
    }
  }
  return contacts;
}

void FrictionalWalk::SelectNext(ConstraintSet free) {
  const TouchingContacts contacts = Touching(true);
  const ConstraintSet closed = Closed();
  const ConstraintSet slipped = SlipsInSpace(system_, mode_);
  mode_ = SelectWord(&dynamics_, point_.x(), contacts, kBorder);
  released_ = released_ | (free - mode_);
  HoldForceless(contacts, (closed & releasing_) - lifted_ - (free - mode_));
  StopInSpace(slipped & mode_.Sticking());
  Drop(closed - mode_ - lifted_);
  landed_ = lifted_ = ConstraintSet();
}

void FrictionalWalk::HoldForceless(const TouchingContacts& contacts, ConstraintSet held) {
  ContactMode holding = mode_;
  for (int i : held) {
    const bool slips = contacts.slipping.Contains(i);
    holding.Set(i, slips ? contacts.slipping.LetterOf(i) : Letter::kStick);
  }
  releasing_ = point_.Forceless(holding, held);
  for (int i : releasing_) mode_.Set(i, holding.LetterOf(i));
  mode_ = mode_.Without(point_.Forceless(mode_, mode_ & hovering_));
  hovering_ = hovering_ - mode_;
}

void FrictionalWalk::Drop(ConstraintSet gone) {
  if (gone.Empty()) return;
  const Vector field = dynamics_.Field(point_.x(), mode_);
  for (int i : gone) {
    const double acceleration = point_.rate_jacobian().row(i).dot(field);
    const bool hovers = acceleration <= kHovers * point_.acceleration();
    (hovers ? hovering_ : dropped_).Insert(i);
    if (!hovers) hovering_.Erase(i);
  }
}

ConstraintSet FrictionalWalk::EndingInSpace() const {
  ConstraintSet ending;
  for (int i : SlipsInSpace(system_, mode_) & transition_.mode_before) {
    if (begun_.count(i) == 0 && point_.SlipVanishes(i)) ending.Insert(i);
  }
  return ending;
}

void FrictionalWalk::ThrowStruck(int i) const {
  throw std::domain_error("the slip in space of contact '" + system_.description().constraints[i] +
                          "' ends as an impact makes it slip anew: what a perturbed run loses of "
                          "it depends on which is first");
}

void FrictionalWalk::StopInSpace(ConstraintSet stopped) {
  if (stopped.Empty()) return;
  const Matrix stop =
      StopProjection(&dynamics_, point_.x(), mode_, stopped, point_.rate_jacobian());
  path_.matrix = stop * path_.matrix;
  GrowSizes(stop);
}

void FrictionalWalk::StopLast() {
  const ContactMode after = transition_.mode_after;
  const ConstraintSet stopped =
      SlipsInSpace(system_, mode_) & transition_.mode_before & after.Sticking();
  if (stopped.Empty()) return;
  point_.MoveTo(transition_.x_plus);
  mode_ = after;
  path_.modes.push_back(after);
  StopInSpace(stopped);
}

void FrictionalWalk::FinishWord() {
  const ContactMode after = transition_.mode_after;
  if (mode_ == after) return;
  if (!begun_.empty()) {
    throw std::domain_error(
        "a perturbed run that begins to slip in space goes on in another contact mode than this "
        "one");
  }
  if (!inputs_.empty() || parted_) {
    const Vector field = dynamics_.Field(point_.x(), mode_);
    const Vector apart = field - dynamics_.Field(point_.x(), after);
    if (apart.cwiseAbs().maxCoeff() > kSameField * (1 + field.cwiseAbs().maxCoeff())) {
      throw std::domain_error("a perturbed run goes on in another contact mode than this one");
    }
  }
  path_.modes.push_back(after);
}

}  // namespace contact_flow
