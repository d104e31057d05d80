// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

namespace contact_flow {

/// A set J ⊂ {0, …, n−1} of constraints, as a value. Indices count from zero in code; names are
/// used wherever a person reads. What its members do is told by a ContactMode. This file alone
/// knows how many there may be, and how they are kept: 128 in place, as those of most systems are,
/// and what is beyond them in words that copies share, which are not changed any more.
class ConstraintSet {
 public:
  static constexpr int kMaxConstraints = 6144;  ///< largest number of constraints
  /// The bits of a set, 64 a word; the words that follow are zero.
  using Words = std::vector<std::uint64_t>;

  ConstraintSet() = default;
  /// The set of these indices.
  ConstraintSet(std::initializer_list<int> indices) {
    for (int i : indices) Insert(i);
  }
  /// The set of the bits that are 1, of the first 64 indices.
  static ConstraintSet FromBits(std::uint64_t bits) { return {bits, 0, InPlace()}; }
  /// The set of the bits that are 1, 64 a word.
  static ConstraintSet FromWords(const Words& words);
  /// {0, …, n−1}.
  static ConstraintSet All(int n) {
    if (n > kInPlace) return AllBeyond(n);
    return {LeastBits(n), LeastBits(n - 64), InPlace()};
  }

  /// Whether i is in the set.
  bool Contains(int i) const {
    if (i >= kInPlace) return beyond_ != nullptr && ContainsBeyond(i);
    return ((i < 64 ? low_ : high_) >> (i & 63) & 1) != 0;
  }
  /// Whether nothing is.
  bool Empty() const { return (low_ | high_) == 0 && beyond_ == nullptr; }
  /// Number of members.
  int Size() const {
    const int size = __builtin_popcountll(low_) + __builtin_popcountll(high_);
    return beyond_ == nullptr ? size : size + SizeBeyond();
  }
  /// Bit i is 1 for each member i, of the first 64.
  std::uint64_t bits() const { return low_; }
  /// The same of all, 64 a word, at least two.
  Words words() const;

  /// Adds i.
  void Insert(int i) & {
    if (i >= kInPlace) return PutBeyond(i, true);
    (i < 64 ? low_ : high_) |= std::uint64_t{1} << (i & 63);
  }
  /// Takes i away.
  void Erase(int i) & {
    if (i >= kInPlace) return PutBeyond(i, false);
    (i < 64 ? low_ : high_) &= ~(std::uint64_t{1} << (i & 63));
  }
  /// The set with i.
  ConstraintSet With(int i) const {
    ConstraintSet set = *this;
    set.Insert(i);
    return set;
  }
  /// The set without i.
  ConstraintSet Without(int i) const {
    ConstraintSet set = *this;
    set.Erase(i);
    return set;
  }

  /// Where a loop ends.
  struct End {};
  /// Iterates over the members in increasing order: `for (int i : set)`. It goes over those that
  /// the set had when it began.
  class Iterator {
   public:
    /// The index.
    int operator*() const {
      return first_ + (low_ != 0 ? __builtin_ctzll(low_) : 64 + __builtin_ctzll(high_));
    }
    /// To the next one.
    Iterator& operator++() {
      std::uint64_t& word = low_ != 0 ? low_ : high_;
      word &= word - 1;
      if ((low_ | high_) == 0 && beyond_ != nullptr) GoBeyond();
      return *this;
    }
    /// Whether there is more.
    bool operator!=(End) const { return (low_ | high_) != 0; }

   private:
    friend class ConstraintSet;
    explicit Iterator(const ConstraintSet& set) : low_(set.low_), high_(set.high_) {
      if (set.beyond_ != nullptr) Begin(set);
    }
    void Begin(const ConstraintSet& set);
    // To the next two words that are not zero, or to the end.
    void GoBeyond();

    std::uint64_t low_, high_;             // what is left of two words
    int first_ = 0;                        // the first one's index
    std::shared_ptr<const Words> beyond_;  // the words behind the first two
  };
  /// The least member.
  Iterator begin() const { return Iterator(*this); }
  /// Behind the last one.
  End end() const { return {}; }

  /// The members' names, in increasing order of index.
  std::vector<std::string> Names(const std::vector<std::string>& constraints) const;
  /// "{left_foot, right_foot}"; "{}" for the empty set.
  std::string ToString(const std::vector<std::string>& constraints) const;

 private:
  friend ConstraintSet operator|(const ConstraintSet& a, const ConstraintSet& b);
  friend ConstraintSet operator&(const ConstraintSet& a, const ConstraintSet& b);
  friend ConstraintSet operator-(const ConstraintSet& a, const ConstraintSet& b);
  friend bool operator==(const ConstraintSet& a, const ConstraintSet& b);
  friend bool operator<(const ConstraintSet& a, const ConstraintSet& b);

  static constexpr int kInPlace = 128;  // indices below it are kept in place

  struct InPlace {};  // tells words from indices
  ConstraintSet(std::uint64_t low, std::uint64_t high, InPlace) : low_(low), high_(high) {}
  // The n least bits of a word, all or none beyond its ends.
  static std::uint64_t LeastBits(int n) {
    if (n >= 64) return ~std::uint64_t{0};
    return n <= 0 ? 0 : (std::uint64_t{1} << n) - 1;
  }

  static ConstraintSet AllBeyond(int n);
  bool ContainsBeyond(int i) const;
  int SizeBeyond() const;
  void PutBeyond(int i, bool member);
  // Keeps these words, without zeros at their end.
  void KeepBeyond(Words* words);
  // What is beyond of a ∪ b, a ∩ b and a \ b.
  void UniteBeyond(const ConstraintSet& a, const ConstraintSet& b);
  void IntersectBeyond(const ConstraintSet& a, const ConstraintSet& b);
  void SubtractBeyond(const ConstraintSet& a, const ConstraintSet& b);
  static bool SameBeyond(const ConstraintSet& a, const ConstraintSet& b);
  // Less than 0, 0 or more as a is less than b, equal to it or more.
  static int CompareBeyond(const ConstraintSet& a, const ConstraintSet& b);

  // Two words that are chosen take fewer instructions than one number that is shifted.
  std::uint64_t low_ = 0, high_ = 0;
  // The words from kInPlace on, the last one not zero; null where nothing is there.
  std::shared_ptr<const Words> beyond_;
};

/// Union.
inline ConstraintSet operator|(const ConstraintSet& a, const ConstraintSet& b) {
  ConstraintSet set(a.low_ | b.low_, a.high_ | b.high_, ConstraintSet::InPlace());
  if (a.beyond_ != nullptr || b.beyond_ != nullptr) set.UniteBeyond(a, b);
  return set;
}
/// Intersection.
inline ConstraintSet operator&(const ConstraintSet& a, const ConstraintSet& b) {
  ConstraintSet set(a.low_ & b.low_, a.high_ & b.high_, ConstraintSet::InPlace());
  if (a.beyond_ != nullptr && b.beyond_ != nullptr) set.IntersectBeyond(a, b);
  return set;
}
/// Set difference.
inline ConstraintSet operator-(const ConstraintSet& a, const ConstraintSet& b) {
  ConstraintSet set(a.low_ & ~b.low_, a.high_ & ~b.high_, ConstraintSet::InPlace());
  if (a.beyond_ != nullptr) set.SubtractBeyond(a, b);
  return set;
}
/// The same members.
inline bool operator==(const ConstraintSet& a, const ConstraintSet& b) {
  return ((a.low_ ^ b.low_) | (a.high_ ^ b.high_)) == 0 &&
         (a.beyond_ == b.beyond_ || ConstraintSet::SameBeyond(a, b));
}
/// Other members.
inline bool operator!=(const ConstraintSet& a, const ConstraintSet& b) { return !(a == b); }
/// Any order, for maps.
inline bool operator<(const ConstraintSet& a, const ConstraintSet& b) {
  if (a.beyond_ != b.beyond_) {
    const int order = ConstraintSet::CompareBeyond(a, b);
    if (order != 0) return order < 0;
  }
  return std::tie(a.high_, a.low_) < std::tie(b.high_, b.low_);
}

}  // namespace contact_flow
