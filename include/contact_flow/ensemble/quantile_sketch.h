// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "contact_flow/ensemble/bytes.h"

namespace contact_flow {

/// Quantiles of many numbers in little memory (Munro & Paterson 1980, as KLL by Karnin, Lang &
/// Liberty 2016 with levels of equal capacity): level h holds sorted values that stand for 2ʰ each.
/// A full level hands every other value to the next, from the first or the second on by turns that
/// are a function of what was there before. So the same numbers, added and merged in the same
/// order, give the same bits. Exact up to 2 kCapacity numbers; then the rank of an answer is off by
/// RankError() at most, and mostly by far less: n/(4 kCapacity).
class QuantileSketch {
 public:
  static constexpr std::size_t kCapacity = 512;  ///< half of what a level holds

  /// Adds a number; not NaN.
  void Add(double value);
  /// Adds what another one has.
  void Merge(const QuantileSketch& other);

  /// How many numbers were added.
  std::uint64_t count() const { return count_; }
  /// The value v with about p · count() numbers ≤ v, p ∈ [0, 1]; NaN where there are none.
  double Quantile(double p) const;
  /// By how many ranks an answer may be off at most.
  std::uint64_t RankError() const { return rank_error_; }

  /// To bytes and back.
  void Write(ByteWriter* out) const;
  /// Throws std::invalid_argument for what Write did not write.
  static QuantileSketch Read(ByteReader* in);

 private:
  void Sort();
  void Compact();

  std::vector<std::vector<double>> levels_;
  std::size_t unsorted_ = 0;  // of level 0, at its end
  std::uint64_t count_ = 0, rank_error_ = 0, compactions_ = 0;
};

}  // namespace contact_flow
