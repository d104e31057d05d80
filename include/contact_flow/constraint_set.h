// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <tuple>
#include <vector>

namespace contact_flow {

/// A set J ⊂ {0, …, n−1} of constraints, as a value. Indices count from zero in code; names are
/// used wherever a person reads. What its members do is told by a ContactMode. This file alone
/// knows how many there may be, and how they are kept.
class ConstraintSet {
 public:
  static constexpr int kMaxConstraints = 128;  ///< largest number of constraints
  /// The bits of a set, 64 a word.
  using Words = std::array<std::uint64_t, kMaxConstraints / 64>;

  ConstraintSet() = default;
  /// The set of these indices.
  ConstraintSet(std::initializer_list<int> indices) {
    for (int i : indices) Insert(i);
  }
  /// The set of the bits that are 1, of the first 64 indices.
  static ConstraintSet FromBits(std::uint64_t bits) { return {bits, 0, Bits()}; }
  /// The set of the bits that are 1, 64 a word.
  static ConstraintSet FromWords(const Words& words) { return {words[0], words[1], Bits()}; }
  /// {0, …, n−1}.
  static ConstraintSet All(int n) { return {LeastBits(n), LeastBits(n - 64), Bits()}; }

  /// Whether i is in the set.
  bool Contains(int i) const { return ((i < 64 ? low_ : high_) >> (i & 63) & 1) != 0; }
  /// Whether nothing is.
  bool Empty() const { return (low_ | high_) == 0; }
  /// Number of members.
  int Size() const { return __builtin_popcountll(low_) + __builtin_popcountll(high_); }
  /// Bit i is 1 for each member i, of the first 64.
  std::uint64_t bits() const { return low_; }
  /// The same of all, 64 a word.
  Words words() const { return {low_, high_}; }

  /// Adds i.
  void Insert(int i) & { (i < 64 ? low_ : high_) |= std::uint64_t{1} << (i & 63); }
  /// Takes i away.
  void Erase(int i) & { (i < 64 ? low_ : high_) &= ~(std::uint64_t{1} << (i & 63)); }
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

  /// Iterates over the members in increasing order: `for (int i : set)`.
  class Iterator {
   public:
    /// The index.
    int operator*() const {
      return low_ != 0 ? __builtin_ctzll(low_) : 64 + __builtin_ctzll(high_);
    }
    /// To the next one.
    Iterator& operator++() {
      std::uint64_t& word = low_ != 0 ? low_ : high_;
      word &= word - 1;
      return *this;
    }
    /// Whether there is more.
    bool operator!=(Iterator o) const { return ((low_ ^ o.low_) | (high_ ^ o.high_)) != 0; }

   private:
    friend class ConstraintSet;
    Iterator(std::uint64_t low, std::uint64_t high) : low_(low), high_(high) {}
    std::uint64_t low_, high_;  // what is left
  };
  /// The least member.
  Iterator begin() const { return {low_, high_}; }
  /// Behind the last one.
  Iterator end() const { return {0, 0}; }

  /// The members' names, in increasing order of index.
  std::vector<std::string> Names(const std::vector<std::string>& constraints) const;
  /// "{left_foot, right_foot}"; "{}" for the empty set.
  std::string ToString(const std::vector<std::string>& constraints) const;

 private:
  friend ConstraintSet operator|(ConstraintSet a, ConstraintSet b);
  friend ConstraintSet operator&(ConstraintSet a, ConstraintSet b);
  friend ConstraintSet operator-(ConstraintSet a, ConstraintSet b);
  friend bool operator==(ConstraintSet a, ConstraintSet b);
  friend bool operator<(ConstraintSet a, ConstraintSet b);

  struct Bits {};  // tells words from indices
  ConstraintSet(std::uint64_t low, std::uint64_t high, Bits) : low_(low), high_(high) {}
  // The n least bits of a word, all or none beyond its ends.
  static std::uint64_t LeastBits(int n) {
    if (n >= 64) return ~std::uint64_t{0};
    return n <= 0 ? 0 : (std::uint64_t{1} << n) - 1;
  }

  // Two words that are chosen take fewer instructions than one number that is shifted.
  std::uint64_t low_ = 0, high_ = 0;
};

static_assert(sizeof(ConstraintSet) == sizeof(ConstraintSet::Words), "keeps its words alone");

/// Union.
inline ConstraintSet operator|(ConstraintSet a, ConstraintSet b) {
  return {a.low_ | b.low_, a.high_ | b.high_, ConstraintSet::Bits()};
}
/// Intersection.
inline ConstraintSet operator&(ConstraintSet a, ConstraintSet b) {
  return {a.low_ & b.low_, a.high_ & b.high_, ConstraintSet::Bits()};
}
/// Set difference.
inline ConstraintSet operator-(ConstraintSet a, ConstraintSet b) {
  return {a.low_ & ~b.low_, a.high_ & ~b.high_, ConstraintSet::Bits()};
}
/// The same members.
inline bool operator==(ConstraintSet a, ConstraintSet b) {
  return ((a.low_ ^ b.low_) | (a.high_ ^ b.high_)) == 0;
}
/// Other members.
inline bool operator!=(ConstraintSet a, ConstraintSet b) { return !(a == b); }
/// Any order, for maps.
inline bool operator<(ConstraintSet a, ConstraintSet b) {
  return std::tie(a.high_, a.low_) < std::tie(b.high_, b.low_);
}

}  // namespace contact_flow
