// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/sobol.h"

#include <boost/random/sobol.hpp>
#include <stdexcept>
#include <string>

#include "contact_flow/ensemble/philox.h"

namespace contact_flow {
namespace {

constexpr std::uint64_t kShiftStream = ~std::uint64_t{0};  // no run has this number

}  // namespace

ShiftedSobol::ShiftedSobol(int dimensions, std::uint64_t seed, bool shifted) {
  if (dimensions < 1 || dimensions > kMaxDimension) {
    throw std::invalid_argument("Sobol's sequence has 1 to " + std::to_string(kMaxDimension) +
                                " dimensions here, not " + std::to_string(dimensions));
  }
  boost::random::sobol engine(static_cast<std::size_t>(dimensions));
  directions_.resize(static_cast<std::size_t>(dimensions));
  for (int j = 0; j < kMaxBits; ++j) {
    // The point behind number n has the Gray code of n + 1; that of 2ʲ⁺¹ − 1 is 2ʲ: v_j alone.
    engine.seed((std::uint64_t{1} << (j + 1)) - 2);
    for (auto& v : directions_) v[static_cast<std::size_t>(j)] = engine();
  }
  Philox random(seed, kShiftStream);
  for (int k = 0; k < dimensions; ++k) shift_.push_back(shifted ? random.Next() : 0);
}

std::uint64_t ShiftedSobol::Bits(std::uint64_t k, int dimension) const {
  const auto& v = directions_[static_cast<std::size_t>(dimension)];
  std::uint64_t bits = shift_[static_cast<std::size_t>(dimension)];
  for (std::uint64_t gray = k ^ (k >> 1); gray != 0; gray &= gray - 1) {
    bits ^= v[static_cast<std::size_t>(__builtin_ctzll(gray))];
  }
  return bits;
}

}  // namespace contact_flow
