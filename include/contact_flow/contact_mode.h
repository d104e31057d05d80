// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tuple>
#include <vector>

#include "contact_flow/constraint_set.h"

namespace contact_flow {

/// What a contact does, the letter of a mode word.
enum class Letter : char {
  kOpen = 'o',      ///< not in contact
  kSlip = 'l',      ///< in contact, and free to slip: without friction, or in space
  kStick = 's',     ///< in contact without slip
  kForward = '+',   ///< slips in the plane, T v > 0
  kBackward = '-',  ///< slips in the plane, T v < 0
};

/// A contact mode, as a value: the set J of active constraints (Sec. 2 of the paper), its members,
/// and with friction what each of them does, by a letter. Without friction all letters are kSlip.
///
/// A mode is a set where a set is asked for, so that `mode - open` and the like are sets, without
/// letters; a set becomes a mode by `ContactMode(set)` alone. Operations with a name keep letters.
/// A mode and a set are not compared: `mode.Members() == set`. What changes one is for variables
/// alone: into a temporary, such as a choice between a mode and a set is, nothing is put.
class ContactMode {
 public:
  /// Nothing is in contact.
  ContactMode() = default;
  /// The mode whose members slip.
  explicit ContactMode(const ConstraintSet& members) : members_(members) {}

  /// The active constraints.
  const ConstraintSet& Members() const { return members_; }
  /// The same.
  operator const ConstraintSet&() const { return members_; }
  /// What constraint i does.
  Letter LetterOf(int i) const {
    if (!Contains(i)) return Letter::kOpen;
    const bool low = low_.Contains(i);
    if (high_.Contains(i)) return low ? Letter::kBackward : Letter::kForward;
    return low ? Letter::kStick : Letter::kSlip;
  }
  /// The members that stick.
  ConstraintSet Sticking() const { return low_ - high_; }
  /// The members that slip in the plane, forward or backward.
  ConstraintSet SlippingInPlane() const { return high_; }

  /// Makes constraint i do this.
  void Set(int i, Letter letter) & {
    Erase(i);
    if (letter == Letter::kOpen) return;
    members_.Insert(i);
    if (letter == Letter::kStick || letter == Letter::kBackward) low_.Insert(i);
    if (letter == Letter::kForward || letter == Letter::kBackward) high_.Insert(i);
  }
  /// Makes i active: it slips if it is new, and keeps its letter if not.
  void Insert(int i) & { members_.Insert(i); }
  /// Takes i away.
  void Erase(int i) & { *this = Without(i); }
  /// The mode in which i is active, too, as Insert makes it.
  ContactMode With(int i) const { return {members_.With(i), low_, high_}; }
  /// The mode without i.
  ContactMode Without(int i) const {
    return {members_.Without(i), low_.Without(i), high_.Without(i)};
  }
  /// The mode without these.
  ContactMode Without(const ConstraintSet& set) const {
    return {members_ - set, low_ - set, high_ - set};
  }
  /// The mode of both modes' members. Of a contact of both the letter is that of `later`, unless it
  /// slips freely there.
  ContactMode Union(const ContactMode& later) const {
    const ConstraintSet told = later.low_ | later.high_;
    return {members_ | later.members_, (low_ - told) | later.low_, (high_ - told) | later.high_};
  }
  /// The mode of these alone, of its members.
  ContactMode Among(const ConstraintSet& set) const {
    return {members_ & set, low_ & set, high_ & set};
  }

  /// Whether i is active.
  bool Contains(int i) const { return members_.Contains(i); }
  /// Whether nothing is.
  bool Empty() const { return members_.Empty(); }
  /// Number of members.
  int Size() const { return members_.Size(); }
  /// The members in increasing order: `for (int i : mode)`.
  ConstraintSet::Iterator begin() const { return members_.begin(); }
  /// Behind the last one.
  ConstraintSet::End end() const { return members_.end(); }

  /// One letter a constraint, "s-o"; of the first n.
  std::string Word(int n) const;
  /// The members' names, as of a ConstraintSet.
  std::vector<std::string> Names(const std::vector<std::string>& constraints) const {
    return members_.Names(constraints);
  }
  /// "{left_foot, right_foot}", as of a ConstraintSet.
  std::string ToString(const std::vector<std::string>& constraints) const {
    return members_.ToString(constraints);
  }

 private:
  friend bool operator==(const ContactMode& a, const ContactMode& b);
  friend bool operator<(const ContactMode& a, const ContactMode& b);

  ContactMode(const ConstraintSet& members, const ConstraintSet& low, const ConstraintSet& high)
      : members_(members), low_(low), high_(high) {}

  ConstraintSet members_;
  ConstraintSet low_, high_;  // two bits a letter, zero off members_
};

/// The same members with the same letters.
inline bool operator==(const ContactMode& a, const ContactMode& b) {
  return a.members_ == b.members_ && a.low_ == b.low_ && a.high_ == b.high_;
}
/// Other members, or letters.
inline bool operator!=(const ContactMode& a, const ContactMode& b) { return !(a == b); }
/// Any order, for maps.
inline bool operator<(const ContactMode& a, const ContactMode& b) {
  return std::tie(a.members_, a.low_, a.high_) < std::tie(b.members_, b.low_, b.high_);
}
// Whether letters count is to be said.
bool operator==(ContactMode, ConstraintSet) = delete;
bool operator==(ConstraintSet, ContactMode) = delete;
bool operator!=(ContactMode, ConstraintSet) = delete;
bool operator!=(ConstraintSet, ContactMode) = delete;
bool operator<(ContactMode, ConstraintSet) = delete;
bool operator<(ConstraintSet, ContactMode) = delete;

}  // namespace contact_flow
