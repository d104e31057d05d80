// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/philox.h"

namespace contact_flow {
namespace {

constexpr std::uint64_t kMultiplier0 = 0xD2E7470EE14C6C93, kMultiplier1 = 0xCA5A826395121157;
constexpr std::uint64_t kWeyl0 = 0x9E3779B97F4A7C15, kWeyl1 = 0xBB67AE8584CAA73B;
constexpr int kRounds = 10;

/// The upper half of a · b.
std::uint64_t High(std::uint64_t a, std::uint64_t b) {
  const std::uint64_t a0 = a & 0xFFFFFFFF, a1 = a >> 32, b0 = b & 0xFFFFFFFF, b1 = b >> 32;
  const std::uint64_t middle = a1 * b0 + (a0 * b0 >> 32);
  const std::uint64_t low = a0 * b1 + (middle & 0xFFFFFFFF);
  return a1 * b1 + (middle >> 32) + (low >> 32);
}

}  // namespace

void Philox::Refill() {
  for (std::uint64_t& word : counter_) {
    if (++word != 0) break;
  }
  block_ = counter_;
  std::uint64_t k0 = key_[0], k1 = key_[1];
  for (int round = 0; round < kRounds; ++round) {
    const std::uint64_t high0 = High(kMultiplier0, block_[0]), low0 = kMultiplier0 * block_[0];
    const std::uint64_t high1 = High(kMultiplier1, block_[2]), low1 = kMultiplier1 * block_[2];
    block_ = {high1 ^ block_[1] ^ k0, low1, high0 ^ block_[3] ^ k1, low0};
    k0 += kWeyl0;
    k1 += kWeyl1;
  }
  used_ = 0;
}

double Philox::Normal() { return NormalQuantile(OpenInterval(Next())); }

}  // namespace contact_flow
