// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace contact_flow {
namespace adversary {

/// Random numbers of a seed, the same on every machine: standard distributions are not.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(0x9E3779B97F4A7C15u * (seed + 1)) {
    engine_.discard(8);
  }
  double Uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) / 9007199254740992.0);
  }
  /// 0 … n−1.
  int Below(int n) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(n)); }
  bool Chance(double share) { return Uniform(0, 1) < share; }
  double Sign() { return Chance(0.5) ? 1 : -1; }
  /// As likely in each decade.
  double Log(double low, double high) { return low * std::exp(Uniform(0, std::log(high / low))); }
  /// Of variance 1: a sum of twelve.
  double Normal() {
    double sum = -6;
    for (int k = 0; k < 12; ++k) sum += Uniform(0, 1);
    return sum;
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace adversary
}  // namespace contact_flow
