// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace contact_flow {
namespace benchmark {

/// Heap allocations of this process so far: malloc, and with it Eigen and operator new. −1 where
/// the C library is not glibc.
long AllocationCount();

}  // namespace benchmark
}  // namespace contact_flow
