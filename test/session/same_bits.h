// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstring>

#include "src/session/session.h"

namespace contact_flow {

/// Bits count: −0 is not 0.
inline bool SameBits(const MatrixRef& a, const MatrixRef& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return false;
  const Matrix left = a, right = b;
  return std::memcmp(left.data(), right.data(),
                     static_cast<std::size_t>(left.size()) * sizeof(double)) == 0;
}

inline bool SameBits(const Instant& a, const Instant& b) {
  return a.t == b.t && SameBits(a.x, b.x) && SameBits(a.u, b.u) && SameBits(a.force, b.force) &&
         SameBits(a.acceleration, b.acceleration) && a.mode == b.mode;
}

inline bool SameBits(const MarkReading& a, const MarkReading& b) {
  return a.t_mark == b.t_mark && a.names == b.names && SameBits(a.directions, b.directions) &&
         a.now.t == b.now.t && SameBits(a.now.tangents, b.now.tangents) &&
         SameBits(a.now.time, b.now.time) && a.now.status.outcome == b.now.status.outcome;
}

}  // namespace contact_flow
