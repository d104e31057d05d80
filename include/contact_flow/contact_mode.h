// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <tuple>
#include <vector>

namespace contact_flow {

/// What a contact does, the letter of a mode word.
enum class Letter : char {
  kOpen = 'o',      ///< not in contact
  kSlip = 'l',      ///< in contact, and free to slip: without friction, or in space
  kStick = 's',     ///< in contact without slip
  kForward = '+',   ///< slips in the plane, T v > 0
  kBackward = '-',  ///< slips in the plane, T v < 0
};

/// A contact mode: the set J ⊂ {0, …, n−1} of active constraints (Sec. 2 of the paper), as a value,
/// and with friction a letter for each of them. Indices count from zero in code; names are used
/// wherever a person reads. At most kMaxConstraints. Without friction all letters of J are kSlip.
/// Operations on sets keep the letters of the left operand's members, a union those of both.
class ContactMode {
  /// 128 bits. Two words that are indexed take fewer instructions than one number that is shifted.
  struct Bits {
    std::uint64_t low = 0, high = 0;

    static constexpr Bits One(int i) {
      const std::uint64_t bit = std::uint64_t{1} << (i & 63);
      return i < 64 ? Bits{bit, 0} : Bits{0, bit};
    }
    bool Has(int i) const { return ((i < 64 ? low : high) >> (i & 63) & 1) != 0; }
    void Add(int i) { (i < 64 ? low : high) |= std::uint64_t{1} << (i & 63); }
    bool Empty() const { return (low | high) == 0; }
    Bits operator&(Bits o) const { return {low & o.low, high & o.high}; }
    Bits operator|(Bits o) const { return {low | o.low, high | o.high}; }
    Bits operator~() const { return {~low, ~high}; }
    bool operator==(Bits o) const { return ((low ^ o.low) | (high ^ o.high)) == 0; }
    bool operator<(Bits o) const { return std::tie(high, low) < std::tie(o.high, o.low); }
  };

 public:
  static constexpr int kMaxConstraints = 128;  ///< largest number of constraints

  ContactMode() = default;
  /// The set of these indices.
  ContactMode(std::initializer_list<int> indices) {
    for (int i : indices) Insert(i);
  }
  /// The set of the bits that are 1, of the first 64 indices.
  static ContactMode FromBits(std::uint64_t bits) { return Of({bits, 0}); }
  /// The set of the bits that are 1, 64 a word.
  static ContactMode FromWords(const std::array<std::uint64_t, 2>& words) {
    return Of({words[0], words[1]});
  }
  /// {0, …, n−1}.
  static ContactMode All(int n) { return Of({LeastBits(n), LeastBits(n - 64)}); }

  /// Whether i is in the set.
  bool Contains(int i) const { return bits_.Has(i); }
  /// Whether nothing is.
  bool Empty() const { return bits_.Empty(); }
  /// Number of members.
  int Size() const { return __builtin_popcountll(bits_.low) + __builtin_popcountll(bits_.high); }
  /// Bit i is 1 for each member i, of the first 64.
  std::uint64_t bits() const { return bits_.low; }
  /// The same of all, 64 a word.
  std::array<std::uint64_t, 2> words() const { return {bits_.low, bits_.high}; }

  /// Adds i.
  void Insert(int i) { bits_.Add(i); }
  /// Takes i away.
  void Erase(int i) { *this = Without(i); }
  /// The set with i, which slips if it is new.
  ContactMode With(int i) const {
    ContactMode mode = *this;
    mode.Insert(i);
    return mode;
  }
  /// The set without i.
  ContactMode Without(int i) const { return *this & Of(~Bits::One(i)); }

  /// What constraint i does.
  Letter LetterOf(int i) const {
    if (!Contains(i)) return Letter::kOpen;
    const bool low = low_.Has(i);
    if (high_.Has(i)) return low ? Letter::kBackward : Letter::kForward;
    return low ? Letter::kStick : Letter::kSlip;
  }
  /// Makes constraint i do this.
  void Set(int i, Letter letter) {
    Erase(i);
    if (letter == Letter::kOpen) return;
    bits_.Add(i);
    if (letter == Letter::kStick || letter == Letter::kBackward) low_.Add(i);
    if (letter == Letter::kForward || letter == Letter::kBackward) high_.Add(i);
  }
  /// The members that stick.
  ContactMode Sticking() const { return Of(low_ & ~high_); }
  /// The members that slip in the plane, forward or backward.
  ContactMode SlippingInPlane() const { return Of(high_); }
  /// The members alone, without letters.
  ContactMode Members() const { return Of(bits_); }
  /// One letter a constraint, "s-o"; of the first n.
  std::string Word(int n) const;

  /// Union.
  ContactMode operator|(ContactMode o) const {
    return ContactMode(bits_ | o.bits_, low_ | o.low_, high_ | o.high_);
  }
  /// Intersection.
  ContactMode operator&(ContactMode o) const {
    return ContactMode(bits_ & o.bits_, low_ & o.bits_, high_ & o.bits_);
  }
  /// Set difference.
  ContactMode operator-(ContactMode o) const { return *this & Of(~o.bits_); }
  /// The same members with the same letters.
  bool operator==(ContactMode o) const {
    return bits_ == o.bits_ && low_ == o.low_ && high_ == o.high_;
  }
  /// Other members, or letters.
  bool operator!=(ContactMode o) const { return !(*this == o); }
  /// Any order, for maps.
  bool operator<(ContactMode o) const {
    return std::tie(bits_, low_, high_) < std::tie(o.bits_, o.low_, o.high_);
  }

  /// Iterates over the members in increasing order: `for (int i : mode)`.
  class Iterator {
   public:
    /// The index.
    int operator*() const {
      return bits_.low != 0 ? __builtin_ctzll(bits_.low) : 64 + __builtin_ctzll(bits_.high);
    }
    /// To the next one.
    Iterator& operator++() {
      std::uint64_t& word = bits_.low != 0 ? bits_.low : bits_.high;
      word &= word - 1;
      return *this;
    }
    /// Whether there is more.
    bool operator!=(Iterator o) const { return !(bits_ == o.bits_); }

   private:
    friend class ContactMode;
    explicit Iterator(Bits bits) : bits_(bits) {}
    Bits bits_;
  };
  /// The least member.
  Iterator begin() const { return Iterator(bits_); }
  /// Behind the last one.
  Iterator end() const { return Iterator({}); }

  /// The members' names, in increasing order of index.
  std::vector<std::string> Names(const std::vector<std::string>& constraints) const;
  /// "{left_foot, right_foot}"; "{}" when no constraint is active.
  std::string ToString(const std::vector<std::string>& constraints) const;

 private:
  ContactMode(Bits bits, Bits low, Bits high) : bits_(bits), low_(low), high_(high) {}
  static ContactMode Of(Bits bits) { return ContactMode(bits, {}, {}); }
  // The n least bits of a word, all or none beyond its ends.
  static std::uint64_t LeastBits(int n) {
    if (n >= 64) return ~std::uint64_t{0};
    return n <= 0 ? 0 : (std::uint64_t{1} << n) - 1;
  }

  Bits bits_;
  Bits low_, high_;  // two bits a letter, zero off bits_
};

}  // namespace contact_flow
