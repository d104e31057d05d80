// SPDX-License-Identifier: BSD-3-Clause
// What a cluster with friction leaves of its contacts: letters, and what rests.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

#include "contact_flow/model/driven.h"
#include "frictional_resolution.h"
#include "slip_onset.h"
#include "src/dynamics/decoupled_contacts.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/slips_in_space.h"
#include "src/dynamics/turning_onset.h"

namespace contact_flow {
namespace {

/// How closely the inequalities of a word have to hold, at least.
constexpr double kBorder = 1e-10;
/// A slip in space that begins has this many absolute tolerances, or what it gains in this time,
/// relative to max(1, t): its direction is followed by steps that take less than it has lasted.
constexpr double kOnset = 10, kOnsetTime = 1e-12;
/// Slips of a face have the ratios of their accelerations where these have their directions, by
/// this cosine, and the slowest gains this part of the fastest.
constexpr double kAlong = 0.9, kSlowest = 1e-2;
/// A pull that is none of rounding, relative to the largest force.
constexpr double kPull = 1e-6;
/// A direction of slip that turns by more than this turns forces notably.
constexpr double kTurned = 1e-6;

}  // namespace

/// Whether contact i is still, or slips, and which way.
void FrictionalResolution::Sort(int i, const Vector& rate, const Vector& v, ConstraintSet still,
                                TouchingContacts* contacts) const {
  const Friction& friction = system_.friction()[i];
  if (friction.dimension == 0 || friction.coefficient == 0) {
    contacts->slipping.Insert(i);
    return;
  }
  const auto slip = rate.segment(friction.row, friction.dimension);
  const bool none = slip.norm() <= SlipRounding(friction, v);
  if (std::isinf(friction.coefficient) || still.Contains(i) || none) {
    const Letter letter = result_.transition.mode_before.LetterOf(i);
    const bool begun = (letter == Letter::kForward || letter == Letter::kBackward) &&
                       !still.Contains(i) && result_.transition.activated.Empty();
    if (begun) {  // it has only just begun to slip
      contacts->slipping.Set(i, letter);
    } else {
      contacts->still.Insert(i);
    }
    return;
  }
  if (friction.dimension == 2) {
    contacts->slipping.Insert(i);
    return;
  }
  const Letter letter = result_.transition.mode_before.LetterOf(i);
  const bool keeps = result_.transition.activated.Empty() &&
                     (letter == Letter::kForward || letter == Letter::kBackward);
  contacts->slipping.Set(i, keeps ? letter : slip(0) > 0 ? Letter::kForward : Letter::kBackward);
}

/// A bounce too low to be seen ends with an impact, which stops slips that are no faster.
void FrictionalResolution::SortRising(int i, const Vector& rate, const Vector& v, double low,
                                      ConstraintSet* still, TouchingContacts* contacts) const {
  const Friction& friction = system_.friction()[i];
  const double slip =
      friction.dimension > 0 ? rate.segment(friction.row, friction.dimension).norm() : 0;
  if (rate(i) > 0 && rate(i) <= low && slip <= rate(i)) still->Insert(i);
  Sort(i, rate, v, *still, contacts);
}

/// The motion goes on, and has no derivative.
void FrictionalResolution::NoteSprings(ConstraintSet contacts, const char* forces) {
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << result_.transition.t << " s how contacts "
          << contacts.ToString(system_.description().constraints) << " share their " << forces
          << " decides the motion: as equal springs under them would";
  result_.transition.obstacle = {Outcome::kIndeterminateForces, message.str()};
  result_.warnings.push_back({Outcome::kIndeterminateForces, result_.transition.t, message.str()});
}

void FrictionalResolution::NoteLookAhead(ConstraintSet contacts) {
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << result_.transition.t << " s several motions of contacts "
          << contacts.ToString(system_.description().constraints)
          << " fit; the run follows the only one that fits a little later";
  result_.transition.obstacle = {Outcome::kPainleveIndeterminate, message.str()};
  result_.warnings.push_back(
      {Outcome::kPainleveIndeterminate, result_.transition.t, message.str()});
}

void FrictionalResolution::NoteSeveralMotions(const std::string& motions) {
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << result_.transition.t << " s several motions fit: " << motions
          << "; the run follows the one it was in, or else that of the smallest forces";
  result_.transition.obstacle = {Outcome::kPainleveIndeterminate, message.str()};
  result_.warnings.push_back(
      {Outcome::kPainleveIndeterminate, result_.transition.t, message.str()});
}

void FrictionalResolution::NoteSmallest(ConstraintSet contacts) {
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << result_.transition.t << " s several impulses of contacts "
          << contacts.ToString(system_.description().constraints)
          << " end the impact; the run follows the smallest";
  result_.transition.obstacle = {Outcome::kAmbiguousImpact, message.str()};
  result_.warnings.push_back({Outcome::kAmbiguousImpact, result_.transition.t, message.str()});
}

/// Where a rise is made rest, that turns or ends slips which are no faster: their letters, and
/// those of others, are chosen once more, as the state is told with them.
void FrictionalResolution::SetLettersAsRested(const TouchingContacts& contacts) {
  const Vector v = struck_ = result_.transition.x_plus.tail(d_);
  halted_ = ConstraintSet();
  ChooseLetters(contacts);
  const Vector rested = result_.transition.x_plus.tail(d_);
  TouchingContacts now = contacts;
  bool turned = false;
  for (int i : contacts.slipping& result_.transition.mode_after) {
    const Friction& friction = system_.friction()[i];
    if (friction.dimension == 0 || friction.coefficient == 0) continue;
    const auto rows = terms_.jacobian.middleRows(friction.row, friction.dimension);
    const Vector before = rows * v, slip = rows * rested;
    const double rounding = SlipRounding(friction, v);
    if (before.norm() > rounding && slip.norm() <= rounding) {
      now.slipping.Erase(i);
      now.still.Insert(i);
      halted_.Insert(i);
    } else if (!Notable()) {
      continue;
    } else if (friction.dimension == 2) {
      turned = turned || (slip.normalized() - before.normalized()).norm() > kTurned;
    } else if (before(0) * slip(0) < 0 && std::abs(slip(0)) > Rounding(friction.row, rested)) {
      now.slipping.Set(i, slip(0) > 0 ? Letter::kForward : Letter::kBackward);
      turned = true;
    }
  }
  if (turned || !halted_.Empty()) ChooseLetters(now);
  if (!halted_.Empty() && result_.transition.obstacle.ok()) ObstructHalted();
}

/// What ended the slips is not resolved: how they come to rest depends on bounces not followed.
void FrictionalResolution::ObstructHalted() {
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << result_.transition.t << " s slips of contacts "
          << halted_.ToString(system_.description().constraints)
          << " end with motions too slow to be resolved, which are taken to rest";
  result_.transition.obstacle = {Outcome::kZeno, message.str()};
}

void FrictionalResolution::ChooseLetters(const TouchingContacts& contacts) {
  Transition& cluster = result_.transition;
  WordConventions by;
  cluster.mode_after = SelectWord(&dynamics_, cluster.x_plus, contacts, kBorder, &by);
  if (by.springs) NoteSprings(contacts.still | contacts.slipping, "forces");
  if (by.ahead) NoteLookAhead(contacts.still | contacts.slipping);
  if (by.smallest) NoteSeveralMotions(by.motions);
  if (by.turns) ObstructTurning(contacts.still);
  // The slip of a rise that is made rest ends with it, whatever begins then; one that is not told
  // from none, where another begins.
  resting_ = cluster.mode_after;
  for (int i : (ended_ | unresolved_) & cluster.mode_after.SlippingInPlane()) {
    const bool goes_on = cluster.mode_before.LetterOf(i) == cluster.mode_after.LetterOf(i);
    if (ended_.Contains(i) || !goes_on) resting_.Set(i, Letter::kStick);
  }
  const ConstraintSet begins = BeginInSpace(system_, contacts.still, cluster.mode_after);
  if (begins.Empty()) return Rest({});
  if (cluster.obstacle.ok() && !OnlyBegins(begins) && !JumpsApart()) {
    cluster.obstacle = {Outcome::kNotPiecewiseLinear,
                        "contacts " + begins.ToString(system_.description().constraints) +
                            " begin to slip in space where several events coincide, another slip "
                            "stops, or contacts graze: derivatives across that are not offered"};
  }
  ConstraintSet reached;  // whose forces are on their cones
  for (int g : cluster.guards) reached.Insert(guards_.ConstraintOf(g));
  std::map<int, Eigen::Vector2d> directions;
  if (OnlyBegins(begins) && (begins - reached).Empty()) {
    directions = HeldDirections(&dynamics_, cluster.x_minus, cluster.mode_before, begins);
    if (!directions.empty() && !SlipsGoOn(&dynamics_, cluster.x_plus, cluster.mode_after, resting_,
                                          directions, kOnset * rules_.absolute_tolerance)) {
      if (const auto others = OtherDirections(contacts, begins)) directions = *others;
    }
  }
  if (directions.empty()) {
    WordConventions of_directions;
    directions = OnsetDirections(&dynamics_, cluster.x_plus, contacts, cluster.mode_after, begins,
                                 kBorder, &of_directions);
    if (of_directions.smallest) NoteSeveralMotions(of_directions.motions);
  }
  BeginSlips(directions);
  if (by.springs) ReleasePulling();
}

/// Where a slip against the force that has reached its cone would end at once: those of the motion
/// that is left, if there is one. Accelerations jump.
std::optional<std::map<int, Eigen::Vector2d>> FrictionalResolution::OtherDirections(
    const TouchingContacts& contacts, ConstraintSet begins) {
  const Transition& cluster = result_.transition;
  try {
    auto directions =
        OnsetDirections(&dynamics_, cluster.x_plus, contacts, cluster.mode_after, begins, kBorder);
    NoteLookAhead(begins);
    return directions;
  } catch (const FrictionRefusal&) {
    return std::nullopt;
  }
}

/// The motion is that of the laws; its derivatives are not known.
void FrictionalResolution::ObstructTurning(ConstraintSet still) {
  Transition& cluster = result_.transition;
  const ConstraintSet begins = BeginInSpace(system_, still, cluster.mode_after);
  if (!cluster.obstacle.ok()) return;
  cluster.obstacle = {Outcome::kNotPiecewiseLinear,
                      "contacts " + begins.ToString(system_.description().constraints) +
                          " of one body begin to slip in several directions, as it turns: "
                          "derivatives across that are not offered"};
}

/// By springs, whose slips begin in directions that rigid bodies may not have: what would pull as
/// its slip begins, and rises when it is let go, has let go.
void FrictionalResolution::ReleasePulling() {
  Transition& cluster = result_.transition;
  for (int count = 0; count < system_.num_constraints(); ++count) {
    dynamics_.Evaluate(cluster.x_plus, cluster.mode_after);
    const Vector force = dynamics_.force().head(system_.num_constraints());
    int pulls = -1;
    double least = -kPull * force.cwiseAbs().maxCoeff();
    for (int i : cluster.mode_after - system_.compliant() - dynamics_.shared()) {
      if (!(force(i) < least)) continue;
      pulls = i;
      least = force(i);
    }
    if (pulls < 0) return;
    const ContactMode others = cluster.mode_after.Without(pulls);
    dynamics_.Evaluate(cluster.x_plus, others);
    if (!(terms_.jacobian.row(pulls).dot(dynamics_.acceleration()) + terms_.bias(pulls) > 0))
      return;
    cluster.mode_after = others;
  }
}

/// What slips that begin have for speeds as their bodies move: the slowest 1, if the fastest is not
/// much faster.
std::map<int, double> FrictionalResolution::SpeedsOf(
    const std::map<int, Eigen::Vector2d>& directions) const {
  const Vector& x = result_.transition.x_plus;
  const ContactMode mode = result_.transition.mode_after;
  const InverseInertia inertia(system_, x.head(nq_), x.tail(d_));
  FrictionFrame frame(system_, inertia, mode.Members() - system_.compliant());
  FrictionSolution word;
  for (std::size_t k = 0; k < frame.constraints().size(); ++k) {
    const int i = frame.constraints()[k];
    const auto begins = directions.find(i);
    word.letters.push_back(mode.LetterOf(i));
    word.directions.emplace_back(Eigen::Vector2d::Zero());
    if (begins != directions.end()) word.directions.back() = begins->second;
    frame.problem().contacts[k].slips =
        begins == directions.end() && mode.LetterOf(i) != Letter::kStick;
  }
  const Vector relative = OnsetSpeeds(frame.problem(), word);
  std::map<int, double> speeds;
  double slowest = 1;
  for (std::size_t k = 0; k < frame.constraints().size(); ++k) {
    if (directions.count(frame.constraints()[k]) == 0) continue;
    const double speed = relative(static_cast<Eigen::Index>(k));
    speeds[frame.constraints()[k]] = speed;
    slowest = std::min(slowest, std::max(speed, kSlowest));
  }
  for (auto& [i, speed] : speeds) speed /= slowest;
  return speeds;
}

/// Slips in space begin in these directions with speeds that count as none: those of a face in the
/// ratios of their accelerations, as they depend on each other.
void FrictionalResolution::BeginSlips(const std::map<int, Eigen::Vector2d>& directions) {
  const Transition& cluster = result_.transition;
  double known = rules_.absolute_tolerance;
  for (const auto& [i, direction] : directions) {
    known = std::max(known, SlipRounding(system_.friction()[i], cluster.x_plus.tail(d_)));
  }
  const double size = kOnset * known;
  std::map<int, Eigen::Vector2d> onsets;
  const std::map<int, double> speeds = SpeedsOf(directions);
  for (const auto& [i, direction] : directions) onsets[i] = size * speeds.at(i) * direction;
  Rest(onsets);
  dynamics_.Evaluate(cluster.x_plus, cluster.mode_after);
  const Vector gained = terms_.jacobian * dynamics_.acceleration() + terms_.bias;
  bool face = !dynamics_.shared().Empty();
  double fastest = 0, slowest = std::numeric_limits<double>::infinity();
  for (const auto& [i, direction] : directions) {
    const auto gain = gained.segment<2>(system_.friction()[i].row);
    fastest = std::max(fastest, gain.norm());
    slowest = std::min(slowest, gain.norm());
    face = face && gain.dot(direction) > kAlong * gain.norm();
  }
  const double least = std::max(size, kOnsetTime * std::max(1.0, cluster.t) * fastest);
  face = face && slowest > kSlowest * fastest;
  std::map<int, Eigen::Vector2d> none;
  for (auto& [i, onset] : onsets) {
    none[i].setZero();
    onset = face ? gained.segment<2>(system_.friction()[i].row) * (least / slowest)
                 : Eigen::Vector2d(least * speeds.at(i) * directions.at(i));
    onset_ = std::max(onset_, onset.norm());
  }
  Rest(onsets);
  Vector still = cluster.x_plus;
  MakeRest(system_, resting_, none, &still);
  result_.transition.begun = cluster.x_plus.tail(d_) - still.tail(d_);
}

/// Whether what happens is one event that is no graze, nor a stop in space, or touchdowns that do
/// not feel each other: perturbed runs pass each at an instant of its own, with the same jump.
bool FrictionalResolution::JumpsApart() const {
  const Transition& cluster = result_.transition;
  const bool stops = !(SlipsInSpace(system_, cluster.mode_before) & stopped_).Empty();
  if (!grazed_.Empty() || stops) return false;
  bool lands = true;
  for (int g : cluster.guards) lands = lands && cluster.activated.Contains(guards_.ConstraintOf(g));
  const ConstraintSet touching = cluster.mode_before.Members() | cluster.activated;
  return cluster.guards.size() == 1 || (lands && AreDecoupled(system_, cluster.x_plus, touching));
}

/// Whether nothing happens but that contacts that stick begin to slip, by forces that reach their
/// cones or by the input: no velocity and no force jumps that a perturbation would move, DR = I.
bool FrictionalResolution::OnlyBegins(ConstraintSet begins) const {
  const Transition& cluster = result_.transition;
  bool sticking = cluster.mode_before.Members() == cluster.mode_after.Members();
  for (int g : cluster.guards) {
    sticking = sticking && cluster.mode_before.Sticking().Contains(guards_.ConstraintOf(g));
  }
  return sticking && cluster.activated.Empty() && grazed_.Empty() && stopped_.Empty() &&
         (begins - cluster.mode_before.Sticking()).Empty();
}

}  // namespace contact_flow
