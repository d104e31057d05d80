// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace ros_interface {

/// The request is not served: as much long work as may be is running and waiting already.
class PoolFull : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Lets a node do so much long work at once. Every piece of work begins at once. One that has
/// taken kShortWork becomes long: it goes on in one of `running` places, waits for one in the order
/// of coming, its budget being used up meanwhile, or, where `waiting` others do, is refused. So
/// short requests pass long ones, whose threads step back (work_threads.h). It takes threads for
/// all: running + waiting + those for the short ones.
class WorkPool {
 public:
  static constexpr double kShortWork = 0.1;  // of processor time [s]

  WorkPool(std::size_t running, std::size_t waiting);

  /// One request from its beginning to its end, of one thread.
  class Work {
   public:
    ~Work();
    Work(const Work&) = delete;
    Work& operator=(const Work&) = delete;
    const Budget& budget() const { return budget_; }
    /// From the next question on: of work that other threads do, which this one does not notice.
    /// They are to begin behind that, as they step back together with their maker.
    void CountAsLong() { begin_ = -kShortWork; }
    /// Throws PoolFull where the work was ended for that.
    void ThrowIfRefused() const;

   private:
    friend class WorkPool;
    Work(WorkPool* pool, const std::string& name, BudgetLimits limits, const std::string& why);
    bool Poll();

    WorkPool* const pool_;
    const std::string name_;
    const double max_seconds_;
    double begin_;  // processor time of the thread [s]
    const std::function<bool()> gone_;
    const std::string why_;
    enum class Phase { kShort, kWaiting, kRunning } phase_ = Phase::kShort;
    std::string refused_;
    std::list<Work*>::iterator place_;
    Budget budget_;
  };

  /// Begins a piece of work called `name`. limits.cancelled is asked by its own thread; `why` is
  /// the reason then.
  std::unique_ptr<Work> Begin(const std::string& name, BudgetLimits limits, const std::string& why);

  struct Count {
    std::size_t cancelled = 0, running = 0, waiting = 0;
    std::string sentence;  ///< "simulate for 3.2 s; compare for 0.4 s (waiting)"
  };
  /// Cancels all work of that name, or all for "".
  Count Cancel(const std::string& name, const std::string& reason);
  Count Look() const;

 private:
  Count CountAll() const;  // with the mutex locked
  bool IsNext(const Work& work) const;

  const std::size_t most_running_, most_waiting_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Work*> work_;  // in the order of coming
};

}  // namespace ros_interface
}  // namespace contact_flow
