// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/transition.h"
#include "guard_zeros.h"
#include "resolution.h"

namespace contact_flow {

/// What an impact leaves of the contacts that touch.
struct LeftByImpact {
  Vector rate;                ///< of all rows
  ConstraintSet leaving;      ///< that others throw up
  ConstraintSet bouncing;     ///< that were hit and leave
  ConstraintSet still;        ///< that do not slip
  TouchingContacts contacts;  ///< what does not leave
};

/// Which bounces are made rest, as no guard of theirs is followed.
enum class Unfollowed {
  kUnresolved,      ///< lower than what integration resolves
  kUnseen,          ///< lower than what gaps are computed to
  kUnseenStopping,  ///< these, and slips which are no faster end with them
};

/// Resolves one cluster of a system with friction, in the order of its methods.
class FrictionalResolution {
 public:
  FrictionalResolution(ContactDynamics* dynamics, double t, const Vector& x, ContactMode mode,
                       const TransitionRules& rules)
      : dynamics_(*dynamics),
        system_(dynamics->system()),
        guards_(system_),
        rules_(rules),
        nq_(system_.num_positions()),
        d_(system_.dof()) {
    result_.approach_speed = result_.release_rate = std::numeric_limits<double>::infinity();
    Transition& cluster = result_.transition;
    cluster.t = t;
    cluster.x_minus = cluster.x_plus = x;
    cluster.mode_before = cluster.mode_after = mode;
    cluster.impulse = Vector::Zero(system_.num_rows());
    cluster.relative_tolerance = rules.relative_tolerance;
    cluster.absolute_tolerance = rules.absolute_tolerance;
    system_.Constraints(x.head(nq_), x.tail(d_), &terms_);
    rate_ = terms_.jacobian * x.tail(d_);
  }

  /// No touch is too slow for an impact of its own.
  void LetAllHit() { all_hit_ = true; }
  /// The guards that vanish together with the trigger.
  void Collect(int trigger);
  void Decide();
  /// Where nothing but the input changes.
  void DecideInput();
  /// Where a slip becomes singular: it ends by an impact without collision, the contact lets go, or
  /// a slip that is too slow to be told from rest sticks. False where that cannot be.
  bool EndSlip(int jammed) { return EndSlip(jammed, result_.transition.mode_before); }
  bool LetGo(int i);
  bool Settle(int i);
  /// Letters by the forces here, whatever they were a moment before, beside the slip of contact i.
  /// False where they stay.
  bool ChooseAgain(int i);
  void TellOfSingularSlip(int i, Outcome outcome, const std::string& what);
  /// All that touches and is slow comes to rest together, which is told with `why`. False where no
  /// letters fit behind that.
  bool SettleTogether(Outcome outcome, const std::string& why);
  ResolvedTransition Take() { return std::move(result_); }

 private:
  double Rounding(int row, const Vector& v) const {
    return kRounding * terms_.jacobian.row(row).cwiseAbs().dot(v.cwiseAbs());
  }
  /// Also of what an impact leaves of a rate: beside its jump, in the kinetic metric.
  double RateRounding(int row, const Vector& v) const {
    return std::max(Rounding(row, v), jump_rounding_.size() > 0 ? jump_rounding_(row) : 0);
  }
  double SlipRounding(const Friction& friction, const Vector& v) const;
  double RestRounding(int i, const Vector& v) const;
  void FindJumpRounding(ConstraintSet touching, const Vector& jump);
  ConstraintSet LeftStill(ConstraintSet contacts, const Vector& jump) const;
  /// Speeds up to this are not told from rest.
  double Unresolved() const {
    return std::min(rules_.speed_tolerance, 1e3 * rules_.absolute_tolerance);
  }
  /// A contact that rested before may have drifted by the integrator's error.
  double Drift(int i) const {
    return result_.transition.mode_before.Contains(i) ? 10 * std::abs(rate_(i)) : 0;
  }

  /// A contact that rises so slowly that it is back before it has left.
  double Low(int i) const {
    const double height = kLowReaches * std::max(rules_.reach_tolerance, std::abs(terms_.gap(i)));
    return acceleration_(i) < 0 ? std::sqrt(-2 * acceleration_(i) * height) : 0;
  }

  /// Whether what is made rest is worth a word.
  bool Notable() const { return fastest_rise_ > kNotable * rules_.speed_tolerance; }
  ConstraintSet AddImplied(ConstraintSet touching);
  bool StopsBefore(int guard, const GuardZero& zero, int trigger, const GuardZero& located) const;
  void Note(int guard, double slope);
  void NoteTouch(int i, double slope);
  void Obstruct(int i, const char* what, double slope, const char* unit);
  void Sort(int i, const Vector& rate, const Vector& v, ConstraintSet still,
            TouchingContacts* contacts) const;
  void SortRising(int i, const Vector& rate, const Vector& v, double low, ConstraintSet* still,
                  TouchingContacts* contacts) const;
  double Reach(int i, Unfollowed which) const;
  ConstraintSet PressedBack(const LeftByImpact& left, Unfollowed which);
  bool TurnsBack(ConstraintSet hit) const;
  bool StopSlow(const TouchingContacts& contacts);
  bool RestPressedBack(const LeftByImpact& left, Unfollowed which);
  void RestOrFollow(const LeftByImpact& left);
  ConstraintSet UnresolvedSlips(ConstraintSet contacts) const;
  ConstraintSet Unrisen(const TouchingContacts& contacts);
  void TellOfRest(ConstraintSet pressed_back);
  std::optional<double> BouncesTurn() const;
  void TellOfApex(ConstraintSet closed);
  void NoteSprings(ConstraintSet contacts, const char* forces);
  void NoteLookAhead(ConstraintSet contacts);
  void NoteSeveralMotions(const std::string& motions);
  void NoteSmallest(ConstraintSet contacts);
  bool EndSlip(int jammed, ContactMode word);
  bool RestSlow(double limit, bool stuck);
  void TellOfSettling(Outcome outcome, const std::string& why, double limit);
  void SetLetters(const TouchingContacts& contacts);
  void SetLettersAsRested(const TouchingContacts& contacts);
  ConstraintSet TooSlow(ContactMode slips, const Vector& begin) const;
  void StickWhatDies(const TouchingContacts& contacts, const Vector& begin);
  bool ForcesFit(const Vector& x, ContactMode mode) const;
  void SetLettersOrEndSlip(const TouchingContacts& contacts);
  bool RestSlowSlips(const TouchingContacts& contacts);
  void ChooseLetters(const TouchingContacts& contacts);
  bool JumpsApart() const;
  bool OnlyBegins(ConstraintSet begins) const;
  std::optional<std::map<int, Eigen::Vector2d>> OtherDirections(const TouchingContacts& contacts,
                                                                ConstraintSet begins);
  void ObstructHalted();
  void ObstructTurning(ConstraintSet still);
  void ReleasePulling();
  std::map<int, double> SpeedsOf(const std::map<int, Eigen::Vector2d>& directions) const;
  void BeginSlips(const std::map<int, Eigen::Vector2d>& directions);
  void Rest(const std::map<int, Eigen::Vector2d>& onsets);

  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const Guards guards_;
  const TransitionRules& rules_;
  const int nq_, d_;
  ConstraintTerms terms_;
  Vector acceleration_;       // of the gaps, in the mode before [n]
  Vector rate_;               // of all rows
  Vector jump_rounding_;      // of rates after an impact, by row
  ConstraintSet stopped_;     // whose slip ends here
  ConstraintSet grazed_;      // touched without speed
  ConstraintSet implied_;     // brought along by others
  ConstraintSet ended_;       // whose slip ends with a rise that is made rest
  ConstraintSet unresolved_;  // that slip too slowly for it to tell how, where the input changes
  ConstraintSet halted_;      // whose slip, of some speed, ends with what is made rest
  ContactMode resting_;       // what is made rest: the mode after, with these sticking
  bool all_hit_ = false;      // no touch counts as one without speed
  double onset_ = 0;          // of the fastest slip in space that begins [m/s]
  double fastest_rise_ = 0;   // that is made rest after an impact [m/s]
  ConstraintSet thrown_;      // that bounce meanwhile
  Vector struck_;             // v before anything is made rest [d]
  Vector risen_;              // rates of all rows before that
  std::vector<Vector> bounces_changes_;  // what they gain meanwhile, at most
  double bounces_last_ = 0;              // one after the other [s]
  ResolvedTransition result_;
};

}  // namespace contact_flow
