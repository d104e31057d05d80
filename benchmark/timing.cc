// SPDX-License-Identifier: BSD-3-Clause
#include "timing.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace benchmark {
namespace {

double ProcessSeconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double Batch(const std::function<void()>& task, int calls) {
  const double begin = ProcessSeconds();
  for (int k = 0; k < calls; ++k) task();
  return (ProcessSeconds() - begin) / calls;
}

}  // namespace

double TimeOnce(const std::function<void()>& task) { return Batch(task, 1); }

std::vector<double> TimeInterleaved(const std::vector<std::function<void()>>& tasks,
                                    double batch_seconds, int batches) {
  std::vector<int> calls;
  for (const auto& task : tasks) {
    Batch(task, 1);
    calls.push_back(std::max(1, static_cast<int>(std::ceil(batch_seconds / Batch(task, 1)))));
  }
  std::vector<double> best(tasks.size(), std::numeric_limits<double>::infinity());
  for (int batch = 0; batch < batches; ++batch) {
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      best[k] = std::min(best[k], Batch(tasks[k], calls[k]));
    }
  }
  return best;
}

}  // namespace benchmark
}  // namespace contact_flow
