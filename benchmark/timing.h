// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

namespace contact_flow {
namespace benchmark {

/// Processor time of each task [s per call]: the minimum over batches of at least `batch_seconds`.
/// The tasks take turns, so that a disturbance of the machine meets all of them.
std::vector<double> TimeInterleaved(const std::vector<std::function<void()>>& tasks,
                                    double batch_seconds = 2e-3, int batches = 9);

/// Processor time of one call [s].
double TimeOnce(const std::function<void()>& task);

}  // namespace benchmark
}  // namespace contact_flow
