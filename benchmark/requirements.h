// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace contact_flow {
namespace benchmark {

/// What the figures have to satisfy, collected on the way and printed at the end.
class Requirements {
 public:
  /// `value` must not exceed `limit`.
  void AtMost(const std::string& what, double value, double limit);
  void Print() const;

 private:
  struct Entry {
    std::string what;
    double value, limit;
  };
  std::vector<Entry> entries_;
};

}  // namespace benchmark
}  // namespace contact_flow
