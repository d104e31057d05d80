// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/sweep.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include "contact_flow/budget.h"
#include "run_one.h"

namespace contact_flow {
namespace {

constexpr std::uint64_t kBlock = Tally::kBlock;
constexpr double kLookEvery = 0.05;  // at the caller's budget, by the caller's thread [s]
constexpr int kMaxThreads = 1024;
using Clock = std::chrono::steady_clock;

double Since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

void Validate(const SweepRequest& request) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument(what); };
  if (request.system == nullptr) refuse("a sweep needs a system");
  Validate(request.options);
  Validate(*request.system, request.inputs);
  if (!(request.duration >= 0) || !std::isfinite(request.duration)) {
    refuse("the duration of a sweep must be finite and not negative");
  }
  if (request.first % kBlock != 0) {
    refuse("the first run of a request must be a multiple of " + std::to_string(kBlock));
  }
  constexpr std::uint64_t kMax = std::uint64_t{1} << 61;
  if (request.count > kMax || request.first > kMax) refuse("a sweep has at most 2^61 runs");
  if (request.threads < 0 || request.threads > kMaxThreads) {
    refuse("threads of a sweep: 0 to " + std::to_string(kMaxThreads));
  }
}

/// What the threads of one sweep share.
class Work {
 public:
  Work(const SweepRequest& request, const RunOne& runs, SweepResult* result)
      : request_(request), runs_(runs), result_(result), budget_(BudgetLimits()) {
    blocks_ = (request.count + kBlock - 1) / kBlock;
    result->progress.total = request.count;
  }

  /// Blocks on so many threads. Throws what a thread or the callback threw.
  void Run(int threads) {
    std::vector<std::thread> pool;
    try {
      for (int k = 0; k < threads; ++k) pool.emplace_back([this] { RunBlocks(); });
    } catch (const std::exception&) {  // fewer threads than asked for
      if (pool.empty()) throw;
    }
    Watch(static_cast<int>(pool.size()));
    for (std::thread& thread : pool) thread.join();
    if (!error_) Report();
    if (error_) std::rethrow_exception(error_);
  }

 private:
  /// Blocks, one after the other, until there are none.
  void RunBlocks() {
    const BudgetScope scope(budget_);
    try {
      for (;;) {
        const std::uint64_t block = next_.fetch_add(1);
        if (block >= blocks_ || !RunBlock(block)) break;
      }
    } catch (...) {
      Fail();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    ++ended_;
    changed_.notify_all();
  }

  /// False where the budget ended meanwhile: nothing of the block counts.
  bool RunBlock(std::uint64_t block) {
    Summary summary = runs_.MakeSummary();
    const std::uint64_t begin = block * kBlock, end = std::min(begin + kBlock, request_.count);
    RunOne::Scratch scratch(budget_);
    const auto row = static_cast<std::size_t>(begin);
    const bool done = runs_.HasLanes() && runs_.RunLanes(request_.first + begin, row, end - begin,
                                                         &scratch, &result_->columns, &summary);
    for (std::uint64_t run = begin; run < end && !done && !budget_.cancelled(); ++run) {
      runs_.Run(request_.first + run, static_cast<std::size_t>(run), &scratch, &result_->columns,
                &summary);
    }
    if (budget_.cancelled()) {
      runs_.recorder().Clear(row, static_cast<std::size_t>(end), &result_->columns);
      return false;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    SweepProgress& progress = result_->progress;
    progress.done += end - begin;
    for (const auto& [outcome, count] : summary.outcomes) progress.outcomes[outcome] += count;
    result_->tally.Add(request_.first / kBlock + block, std::move(summary));
    return true;
  }

  /// The caller's thread: waits for `threads`, reports, and hands a cancellation on.
  void Watch(int threads) {
    double reported = 0;
    std::unique_lock<std::mutex> lock(mutex_);
    while (ended_ < threads) {
      changed_.wait_for(lock, std::chrono::duration<double>(kLookEvery));
      lock.unlock();
      try {
        std::string sentence;
        const BudgetEnd end = LookAtBudget(&sentence);
        if (end != BudgetEnd::kNone && result_->status.ok()) {
          result_->status = {
              end == BudgetEnd::kCancelled ? Outcome::kCancelled : Outcome::kBudgetExceeded,
              sentence};
          budget_.Cancel(sentence);
        }
        if (Since(begin_) - reported >= request_.progress_every) {
          reported = Since(begin_);
          Report();
        }
      } catch (...) {  // of the callback: threads must end before it leaves
        Fail();
      }
      lock.lock();
    }
  }

  /// To be called where an exception is caught.
  void Fail() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!error_) error_ = std::current_exception();
    budget_.Cancel("the sweep failed");
  }

  void Report() {
    SweepProgress copy;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      SweepProgress& progress = result_->progress;
      progress.elapsed = Since(begin_);
      progress.rate = static_cast<double>(progress.done) / std::max(progress.elapsed, 1e-9);
      const std::uint64_t left = progress.total - progress.done;
      progress.left = left == 0 ? 0 : static_cast<double>(left) / progress.rate;
      copy = progress;
    }
    if (request_.progress) request_.progress(copy);
  }

  const SweepRequest& request_;
  const RunOne& runs_;
  SweepResult* const result_;
  const Budget budget_;
  const Clock::time_point begin_ = Clock::now();
  std::uint64_t blocks_ = 0;
  std::atomic<std::uint64_t> next_{0};
  std::mutex mutex_;  // guards what follows, and result_->progress and tally
  std::condition_variable changed_;
  std::exception_ptr error_;
  int ended_ = 0;
};

/// Throws BudgetExceeded where `what` takes more than there may be.
void AskMegabytes(const SweepRequest& request, double bytes, const std::string& what,
                  const std::string& instead) {
  if (bytes > 1e6 * request.max_megabytes) {
    throw BudgetExceeded(BudgetEnd::kMegabytes,
                         what + " take " + std::to_string(static_cast<long>(1e-6 * bytes)) +
                             " MB, more than max_megabytes; " + instead);
  }
  AskMemory(bytes, what);
}

}  // namespace

double StatisticsBytes(const SweepRequest& request, int threads) {
  // A summary for each thread and each height of the tree: covariances and histograms, and sketches
  // of as many levels as the height.
  double numbers = 0;
  for (const HistogramAxis& axis : request.histograms) numbers += std::max(axis.bins, 0) + 2.0;
  const double observables =
      2.0 * request.system->dof() + static_cast<double>(request.keep.costs.size());
  numbers += observables * observables;
  const double blocks = std::ceil(static_cast<double>(request.count) / kBlock);
  const double height = std::ceil(std::log2(blocks + 1)) + 1;
  const double sketches =
      2.0 * QuantileSketch::kCapacity * observables * (threads + height * height / 2);
  return 8 * (numbers * (threads + height) + sketches);
}

SweepResult Sweep(const SweepRequest& request) {
  Validate(request);
  SweepResult result;
  result.reference = ReferenceState(request);
  const std::uint64_t blocks = (request.count + kBlock - 1) / kBlock;
  int threads =
      request.threads > 0 ? request.threads : static_cast<int>(std::thread::hardware_concurrency());
  threads = static_cast<int>(
      std::min<std::uint64_t>(static_cast<std::uint64_t>(std::max(threads, 1)), blocks));
  AskMegabytes(request, StatisticsBytes(request, threads),
               "the statistics of " + std::to_string(request.count) + " runs",
               "ask for fewer bins");
  const RunOne runs(request, result.reference);
  const double bytes = runs.recorder().BytesPerRun() * static_cast<double>(request.count);
  AskMegabytes(request, bytes, "the columns of " + std::to_string(request.count) + " runs",
               "keep less of each, or fewer at once");
  result.columns = runs.recorder().Make(request.first, static_cast<std::size_t>(request.count));
  Work work(request, runs, &result);
  work.Run(threads);
  return result;
}

}  // namespace contact_flow
