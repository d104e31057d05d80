// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/trajectory.h"
#include "frictional_walk.h"
#include "walk_guards.h"
#include "walk_point.h"

namespace contact_flow {

/// A walk through a cluster along one direction (w, δt); everything is carried as matrices, so that
/// the result holds on the whole cone of the decisions that it makes.
class FrictionalWalk {
 public:
  FrictionalWalk(ContactDynamics* dynamics, const Transition& transition,
                 const std::vector<Vector>& inputs, const VectorRef& w, const VectorRef& dt);
  ~FrictionalWalk() { dynamics_.SetInput(first_input_); }
  FrictionalWalk(const FrictionalWalk&) = delete;
  FrictionalWalk& operator=(const FrictionalWalk&) = delete;

  FrictionalPath Take();

 private:
  /// Whether the slip of contact i vanishes at the base point.
  bool Still(int i) const { return still_.Contains(i) || (!SlipsOn(i) && point_.SlipVanishes(i)); }
  /// Without an impact what slips stops at an instant of its own, here or however shortly behind.
  bool SlipsOn(int i) const {
    return transition_.activated.Empty() && transition_.mode_before.Contains(i);
  }
  /// D(T v) w of contact i in the plane, or 0 where w does not move it, as where it has only just
  /// begun to slip and has no acceleration; D(A v) w of a row.
  double Moves(int i) const;
  double MovesRow(int row) const;
  /// w lies on the positive side of `row`, whose entries are sums of terms of these sizes.
  void Decide(Eigen::RowVectorXd row, const Eigen::RowVectorXd& sizes);
  void DecideAlong(const Eigen::RowVectorXd& row) {
    Decide(row * path_.matrix, row.cwiseAbs() * path_.matrix.cwiseAbs());
  }
  /// Sizes of terms behind a reset: what it makes zero is the sum of what was there.
  void GrowSizes(const Matrix& reset) {
    const Vector before = sizes_.head(size_);
    sizes_.head(size_) = (reset.cwiseAbs() * before).cwiseMax(before);
  }
  /// The decisions among directions w at fixed instants of the input.
  Matrix Rows() const;
  /// Contacts that stick where the cluster begins, and that w moves: by the projection (F7).
  void SettleSticking();
  /// Contacts that let go as they reach their cones, with an acceleration that jumps, where the
  /// cluster does nothing else.
  ConstraintSet Bursting() const;
  std::vector<WalkGuard> GuardsHere();
  /// The first-order instant of a guard as a row by (w, δt).
  Eigen::RowVectorXd TimeOf(const WalkGuard& guard) const;
  /// The guard that vanishes next; false when none is left.
  bool Next();
  void Pass(const WalkGuard& guard, ConstraintSet along);
  /// A slip that begins in space has no direction among these events, but for `except`.
  void CheckOnset(ConstraintSet except = {}) const;
  /// Those of the mode before that slip.
  ConstraintSet SlippedBefore() const {
    return transition_.mode_before.Members() - transition_.mode_before.Sticking();
  }
  /// Where contacts begin to slip in space behind the last event: their directions are the run's,
  /// whose slips are a little more than none. Behind one before, they begin there, and have to keep
  /// their directions.
  void BeginInRun();
  void BeginHere(ConstraintSet begins, bool last);
  [[noreturn]] void ThrowTurned(int i) const;
  /// The point, where slips that have begun are so many times theirs.
  Vector WithSlips(double times) const;
  /// F of the mode at the point; of slips that begin, where they vanish.
  Vector FieldHere();
  bool IsPulledBack(int i, ContactMode mode) const;
  /// Contacts that let go among these events with an acceleration, and that a later one pulls back
  /// touch again, with a speed of first order.
  void CheckDropped();
  /// Contacts of the same body that an event brings along: what lands, or stops, with it.
  ConstraintSet Along(const WalkGuard& c) const;
  /// Those of `along` that w moves at the instant of c: a direction may part what dependent rows
  /// tie, by parameters, or as they depend at one posture alone.
  ConstraintSet PartedFrom(const WalkGuard& c, ConstraintSet along, const Eigen::RowVectorXd& tau,
                           const Vector& field) const;
  /// `later` has an event of its own; what follows is known where nothing sticks.
  void Part(const WalkGuard& c, int later, ConstraintSet* along);
  void Land(int i, ConstraintSet along);
  /// What rises there with a speed of first order, and is pressed back, lands again at once.
  void LandAgain(ConstraintSet open);
  /// What bounces of plastic contacts add, by their restitutions.
  void AddBounces();
  /// What may be in contact there.
  ConstraintSet Closed() const {
    return ((landed_.Empty() ? mode_.Members() : landed_) | hovering_) - released_;
  }
  /// The same, by their slips; one that vanishes begins where w moves it, if `moved`.
  TouchingContacts Touching(bool moved);
  /// The word at the base point for runs perturbed along w, in which those of `free` may let go.
  void SelectNext(ConstraintSet free = {});
  /// What is to let go, and has no force at the base point, holds until its own release: an event
  /// elsewhere may make its force jump, up or away. What has let go stays away.
  void HoldForceless(const TouchingContacts& contacts, ConstraintSet held);
  /// Contacts that the word lets go: with an acceleration, or without, so that whatever pulls them
  /// back finds them where they were.
  void Drop(ConstraintSet gone);
  /// Slips in space of the mode before that have no speed left at the base point. An impact may
  /// hold them, or leave them alone.
  ConstraintSet EndingInSpace() const;
  [[noreturn]] void ThrowStruck(int i) const;
  /// Slips in space that end at the base point: before or behind what moves none of them by more
  /// than to first order, all the same.
  void StopInSpace(ConstraintSet stopped);
  /// Those that no other event has ended.
  void StopLast();
  /// Guards that are identities change the word alone: where the input changes, or ties are parted,
  /// that is looked at, as these may lead to other words.
  void FinishWord();

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
  ConstraintSet pending_;          // touchdowns to come
  ConstraintSet releasing_;        // forces that are to vanish
  ConstraintSet bursting_;         // see Bursting
  ConstraintSet released_;         // without slip
  ConstraintSet hovering_;         // let go without acceleration
  ConstraintSet dropped_;          // let go with one
  ConstraintSet landed_, lifted_;  // by the last touchdown: what took part, and what left
  ConstraintSet still_;            // known to have no slip at the base point
  ConstraintSet just_stopped_;
  std::map<int, Eigen::Vector2d> begun_;  // slips in space that began before the last event [m/s]
  bool parted_ = false;                   // what depends on another has had an event of its own
  std::size_t changes_ = 0;               // of the input, so far
  Vector passed_;  // sizes of what fields, and forces, did between events so far [2d+k]
  /// A plastic contact that landed, with the speed of its bounce [width] and what that adds [d].
  struct Bounce {
    int constraint;
    Eigen::RowVectorXd speed;
    Vector adds;
  };
  std::vector<Bounce> bounces_;
  std::vector<Eigen::RowVectorXd> decisions_;
  FrictionalPath path_;
};

}  // namespace contact_flow
