// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/simulate_batch.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "contact_flow/budget.h"
#include "lane_runs.h"

namespace contact_flow {
namespace {

void Require(const char* what, Eigen::Index size, Eigen::Index wanted, const char* unit) {
  if (size == wanted) return;
  throw std::invalid_argument(std::string(what) + " has " + std::to_string(size) + " " + unit +
                              ": " + std::to_string(wanted) + " are needed");
}

void ValidateBatch(const MechanicalSystem& system, const MatrixRef& states, const MatrixRef& inputs,
                   double duration, const BatchOptions& batch) {
  Require("states", states.rows(), system.state_size(), "rows (q, v)");
  Require("inputs", inputs.rows(), system.num_inputs(), "rows");
  if (inputs.cols() != 1) Require("inputs", inputs.cols(), states.cols(), "columns, one a run");
  if (!(duration >= 0) || !std::isfinite(duration)) {
    std::ostringstream message;
    message << "duration is " << duration << " s: it must be finite and not negative";
    throw std::invalid_argument(message.str());
  }
  if (batch.threads < 1) {
    throw std::invalid_argument("threads is " + std::to_string(batch.threads) +
                                ": it must be at least 1");
  }
}

/// Starts, one after the other, until there are none.
void Work(const BatchRequest& request, const LanesOfSystem& lanes, std::atomic<std::size_t>* next,
          std::vector<BatchRun>* results) {
  if (lanes.available()) {
    LaneRuns(request, lanes.Make()).Run(next, results);
    return;
  }
  for (std::size_t run; (run = next->fetch_add(1)) < results->size();) {
    (*results)[run] = request.RunAlone(run);
  }
}

/// The same on several threads. This one waits, and hands on the end of its budget.
void WorkOnThreads(int threads, const std::function<void()>& work) {
  constexpr std::chrono::milliseconds kLookEvery(10);
  const Budget budget;
  std::mutex mutex;
  std::condition_variable changed;
  std::exception_ptr error;
  int running = 0;
  const auto run = [&] {
    const BudgetScope scope(budget);
    std::exception_ptr failed;
    try {
      work();
    } catch (...) {
      failed = std::current_exception();
      budget.Cancel("another run of the batch failed");
    }
    const std::lock_guard<std::mutex> lock(mutex);
    if (!error) error = failed;
    --running;
    changed.notify_all();
  };
  std::vector<std::thread> pool;
  for (int k = 0; k < threads; ++k) {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      ++running;
    }
    try {
      pool.emplace_back(run);
    } catch (const std::exception&) {  // fewer threads than asked for
      const std::lock_guard<std::mutex> lock(mutex);
      --running;
      if (pool.empty()) throw;
      break;
    }
  }
  std::unique_lock<std::mutex> lock(mutex);
  while (running > 0) {
    changed.wait_for(lock, kLookEvery);
    std::string sentence;
    if (LookAtBudget(&sentence) != BudgetEnd::kNone) budget.Cancel(sentence);
  }
  lock.unlock();
  for (std::thread& thread : pool) thread.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace

BatchRun BatchRequest::RunAlone(std::size_t run) const {
  BatchRun result;
  result.alone = true;
  SimulateOptions own = options;
  own.dense = false;
  try {
    const Trajectory trajectory =
        Simulate(system, states.col(static_cast<Eigen::Index>(run)), Input(run), duration, own);
    result.status = trajectory.status;
    result.t_end = trajectory.t_end();
    result.final_state = trajectory.FinalState();
    result.error = trajectory.arcs.back().error;
    result.first_mode = trajectory.arcs.front().mode;
    for (const Transition& passed : trajectory.transitions) {
      result.events.push_back(
          {passed.t, passed.activated, passed.released, passed.mode_after, passed.impulse});
    }
    result.margins = trajectory.margins;
    result.statistics = trajectory.statistics;
    result.accumulation_time = trajectory.accumulation_time;
    result.warnings = trajectory.warnings;
    result.num_warnings = trajectory.num_warnings;
  } catch (const std::invalid_argument& reason) {
    result.refused = reason.what();
  }
  return result;
}

BatchResult SimulateBatch(const MechanicalSystem& system, const MatrixRef& states,
                          const MatrixRef& inputs, double duration, const SimulateOptions& options,
                          const BatchOptions& batch) {
  Validate(options);
  ValidateBatch(system, states, inputs, duration, batch);
  const BudgetStage stage("the batch");
  BatchResult result;
  const LanesOfSystem lanes(system, options, batch.lanes);
  result.why = lanes.why();
  result.width = lanes.available() ? lanes.Make()->arrays().width : 1;
  result.runs.resize(static_cast<std::size_t>(states.cols()));
  const BatchRequest request = {system, states, inputs, duration, options};
  std::atomic<std::size_t> next{0};
  const auto work = [&] { Work(request, lanes, &next, &result.runs); };
  const Eigen::Index blocks = (states.cols() + result.width - 1) / result.width;
  const int threads = static_cast<int>(std::min<Eigen::Index>(batch.threads, blocks));
  if (threads > 1) {
    WorkOnThreads(threads, work);
  } else if (states.cols() > 0) {
    work();
  }
  for (const BatchRun& run : result.runs) result.alone += run.alone;
  return result;
}

}  // namespace contact_flow
