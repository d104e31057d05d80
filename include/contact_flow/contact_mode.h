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
  static constexpr int kMaxConstraints = 64;

  ContactMode() = default;
  ContactMode(std::initializer_list<int> indices) {
    for (int i : indices) Insert(i);
  }
  static ContactMode FromBits(std::uint64_t bits) {
    ContactMode mode;
    mode.bits_ = bits;
    return mode;
  }
  /// {0, …, n−1}.
  static ContactMode All(int n) {
    return FromBits(n >= kMaxConstraints ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1);
  }

  bool Contains(int i) const { return (bits_ >> i) & 1u; }
  bool Empty() const { return bits_ == 0; }
  int Size() const { return __builtin_popcountll(bits_); }
  std::uint64_t bits() const { return bits_; }

  void Insert(int i) { bits_ |= std::uint64_t{1} << i; }
  void Erase(int i) { bits_ &= ~(std::uint64_t{1} << i); }
  ContactMode With(int i) const { return FromBits(bits_ | (std::uint64_t{1} << i)); }
  ContactMode Without(int i) const { return FromBits(bits_ & ~(std::uint64_t{1} << i)); }

  ContactMode operator|(ContactMode o) const { return FromBits(bits_ | o.bits_); }
  ContactMode operator&(ContactMode o) const { return FromBits(bits_ & o.bits_); }
  /// Set difference.
  ContactMode operator-(ContactMode o) const { return FromBits(bits_ & ~o.bits_); }
  bool operator==(ContactMode o) const { return bits_ == o.bits_; }
  bool operator!=(ContactMode o) const { return bits_ != o.bits_; }
  bool operator<(ContactMode o) const { return bits_ < o.bits_; }

  /// Iterates over the members in increasing order: `for (int i : mode)`.
  class Iterator {
   public:
    explicit Iterator(std::uint64_t bits) : bits_(bits) {}
    int operator*() const { return __builtin_ctzll(bits_); }
    Iterator& operator++() {
      bits_ &= bits_ - 1;
      return *this;
    }
    bool operator!=(Iterator o) const { return bits_ != o.bits_; }

   private:
    std::uint64_t bits_;
  };
  Iterator begin() const { return Iterator(bits_); }
  Iterator end() const { return Iterator(0); }

  /// The members' names, in increasing order of index.
  std::vector<std::string> Names(const std::vector<std::string>& constraints) const;
  /// "{left_foot, right_foot}"; "{}" when no constraint is active.
  std::string ToString(const std::vector<std::string>& constraints) const;

 private:
  std::uint64_t bits_ = 0;
};

}  // namespace contact_flow
