// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace contact_flow {

/// Sobol's sequence with the direction numbers of Joe and Kuo (2008), in Gray-code order, point 0
/// first (the order of most libraries), shifted by a random number of each dimension, bit by bit:
///   x_k = v_{j1} ⊕ v_{j2} ⊕ … ⊕ shift,    j the bits of k ⊕ ⌊k/2⌋.
/// The shift comes from the seed; any 2ᵐ points from a multiple of 2ᵐ on stay as even as they were.
/// A point depends on seed, dimension and k alone.
class ShiftedSobol {
 public:
  /// In the unit cube of so many dimensions, at most kMaxDimension. `shifted` false: no shift.
  ShiftedSobol(int dimensions, std::uint64_t seed, bool shifted = true);

  /// 64 bits of the coordinate `dimension` of point k < 2⁶².
  std::uint64_t Bits(std::uint64_t k, int dimension) const;

  static constexpr int kMaxDimension = 3667;  ///< of the table of Joe and Kuo that Boost has
  static constexpr int kMaxBits = 62;         ///< of k

 private:
  std::vector<std::array<std::uint64_t, kMaxBits>> directions_;
  std::vector<std::uint64_t> shift_;
};

}  // namespace contact_flow
