// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace contact_flow {

/// Philox4x64-10 (Salmon et al. 2011), a counter-based generator: the bits of run `run` are a
/// function of (seed, run) and of how many were taken before, and of nothing else. They are those
/// of numpy's Generator(Philox(key=[seed, run])) and of Random123 with this key, counters 1, 2, ….
class Philox {
 public:
  /// The stream of one run.
  Philox(std::uint64_t seed, std::uint64_t run) : key_{seed, run} {}

  /// The next 64 bits.
  std::uint64_t Next() {
    if (used_ == 4) Refill();
    return block_[used_++];
  }
  /// Uniform in [0, 1): 53 bits, as numpy's Generator.random.
  double Uniform() { return UnitInterval(Next()); }
  /// Standard normal, of one Next() by the inverse of its distribution function. (numpy's takes a
  /// ziggurat, whose numbers of draws vary.)
  double Normal();

  /// ⌊bits / 2¹¹⌋ 2⁻⁵³ ∈ [0, 1).
  static double UnitInterval(std::uint64_t bits) {
    return static_cast<double>(bits >> 11) * 0x1p-53;
  }
  /// (⌊bits / 2¹²⌋ + ½) 2⁻⁵² ∈ (0, 1), symmetric about ½ and neither 0 nor 1.
  static double OpenInterval(std::uint64_t bits) {
    return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52;
  }

 private:
  void Refill();

  std::array<std::uint64_t, 2> key_;
  std::array<std::uint64_t, 4> counter_{}, block_{};
  int used_ = 4;
};

/// z with P(Z ≤ z) = p for standard normal Z and p ∈ (0, 1): AS 241 (Wichura 1988), relative error
/// below 1e-15. Of sums, products, quotients and square roots alone, so that every IEEE machine
/// gives the same bits. ±∞ at 0 and 1, NaN outside.
double NormalQuantile(double p);

}  // namespace contact_flow
