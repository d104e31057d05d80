// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

namespace contact_flow {

/// A contact mode J ⊂ {0, …, n−1} (Sec. 2 of the paper): the set of active constraints, as a value.
/// Indices count from zero in code; names are used wherever a person reads. At most
/// kMaxConstraints.
class ContactMode {
 public:
  static constexpr int kMaxConstraints = 64;  ///< largest number of constraints

  ContactMode() = default;
  /// The set of these indices.
  ContactMode(std::initializer_list<int> indices) {
    for (int i : indices) Insert(i);
  }
  /// The set of the bits that are 1.
  static ContactMode FromBits(std::uint64_t bits) {
    ContactMode mode;
    mode.bits_ = bits;
    return mode;
  }
  /// {0, …, n−1}.
  static ContactMode All(int n) {
    return FromBits(n >= kMaxConstraints ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1);
  }

  /// Whether i is in the set.
  bool Contains(int i) const { return (bits_ >> i) & 1u; }
  /// Whether nothing is.
  bool Empty() const { return bits_ == 0; }
  /// Number of members.
  int Size() const { return __builtin_popcountll(bits_); }
  /// Bit i is 1 for each member i.
  std::uint64_t bits() const { return bits_; }

  /// Adds i.
  void Insert(int i) { bits_ |= std::uint64_t{1} << i; }
  /// Takes i away.
  void Erase(int i) { bits_ &= ~(std::uint64_t{1} << i); }
  /// The set with i.
  ContactMode With(int i) const { return FromBits(bits_ | (std::uint64_t{1} << i)); }
  /// The set without i.
  ContactMode Without(int i) const { return FromBits(bits_ & ~(std::uint64_t{1} << i)); }

  /// Union.
  ContactMode operator|(ContactMode o) const { return FromBits(bits_ | o.bits_); }
  /// Intersection.
  ContactMode operator&(ContactMode o) const { return FromBits(bits_ & o.bits_); }
  /// Set difference.
  ContactMode operator-(ContactMode o) const { return FromBits(bits_ & ~o.bits_); }
  /// The same members.
  bool operator==(ContactMode o) const { return bits_ == o.bits_; }
  /// Other members.
  bool operator!=(ContactMode o) const { return bits_ != o.bits_; }
  /// Any order, for maps.
  bool operator<(ContactMode o) const { return bits_ < o.bits_; }

  /// Iterates over the members in increasing order: `for (int i : mode)`.
  class Iterator {
   public:
    /// Of what is left to visit.
    explicit Iterator(std::uint64_t bits) : bits_(bits) {}
    /// The index.
    int operator*() const { return __builtin_ctzll(bits_); }
    /// To the next one.
    Iterator& operator++() {
      bits_ &= bits_ - 1;
      return *this;
    }
    /// Whether there is more.
    bool operator!=(Iterator o) const { return bits_ != o.bits_; }

   private:
    std::uint64_t bits_;
  };
  /// The least member.
  Iterator begin() const { return Iterator(bits_); }
  /// Behind the last one.
  Iterator end() const { return Iterator(0); }

  /// The members' names, in increasing order of index.
  std::vector<std::string> Names(const std::vector<std::string>& constraints) const;
  /// "{left_foot, right_foot}"; "{}" when no constraint is active.
  std::string ToString(const std::vector<std::string>& constraints) const;

 private:
  std::uint64_t bits_ = 0;
};

}  // namespace contact_flow
