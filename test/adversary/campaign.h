// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "test/adversary/judge.h"

namespace contact_flow {
namespace adversary {

/// The verdicts on the cases of consecutive seeds.
struct Campaign {
  long systems = 0;
  long directions = 0;
  long undecided = 0;
  std::map<std::string, long> right;                                  // by generator
  std::map<std::string, std::map<std::string, long>> others;          // by kind, by reason
  std::map<std::string, std::map<std::string, std::uint64_t>> first;  // the first seed of each
  struct Finding {
    std::uint64_t seed;
    std::string generator, reason, detail;
  };
  std::vector<Finding> contradicted;

  long Count(const std::string& kind) const;
  void Print(std::ostream* out) const;
};

/// Judges `systems` cases from `first_seed` on, with so many threads.
Campaign RunCampaign(std::uint64_t first_seed, long systems, int threads);

}  // namespace adversary
}  // namespace contact_flow
