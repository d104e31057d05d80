// SPDX-License-Identifier: BSD-3-Clause
#include "requirements.h"

#include <cstdio>

namespace contact_flow {
namespace benchmark {

void Requirements::AtMost(const std::string& what, double value, double limit) {
  entries_.push_back({what, value, limit});
}

void Requirements::Print() const {
  std::printf("\nRequirements (timings vary by a few percent from run to run)\n");
  for (const Entry& entry : entries_) {
    std::printf("  %-7s %-62s %9.3g  (at most %.3g)\n",
                entry.value <= entry.limit ? "holds" : "FAILS", entry.what.c_str(), entry.value,
                entry.limit);
  }
}

}  // namespace benchmark
}  // namespace contact_flow
