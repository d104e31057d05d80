// SPDX-License-Identifier: BSD-3-Clause
#include "work_pool.h"

#include <chrono>
#include <sstream>
#include <utility>

#include "src/clocks.h"
#include "work_threads.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(50);  // until who waits looks whether it may end

}  // namespace

WorkPool::WorkPool(std::size_t running, std::size_t waiting)
    : most_running_(running), most_waiting_(waiting) {}

WorkPool::Work::Work(WorkPool* pool, const std::string& name, BudgetLimits limits,
                     const std::string& why)
    : pool_(pool),
      name_(name),
      max_seconds_(limits.max_seconds),
      begin_(ThreadSeconds()),
      gone_(std::move(limits.cancelled)),
      why_(why),
      budget_({limits.max_seconds, limits.max_megabytes, [this] { return Poll(); }}) {}

std::unique_ptr<WorkPool::Work> WorkPool::Begin(const std::string& name, BudgetLimits limits,
                                                const std::string& why) {
  std::unique_ptr<Work> work(new Work(this, name, std::move(limits), why));
  const std::lock_guard<std::mutex> lock(mutex_);
  work->place_ = work_.insert(work_.end(), work.get());
  return work;
}

WorkPool::Work::~Work() {
  BackToTheFront();  // what follows is short: others may wait for it
  {
    const std::lock_guard<std::mutex> lock(pool_->mutex_);
    pool_->work_.erase(place_);
  }
  pool_->changed_.notify_all();
}

void WorkPool::Work::ThrowIfRefused() const {
  if (!refused_.empty()) throw PoolFull(refused_);
}

/// Asked by the working thread now and then; true ends the work. Waits here for a place.
bool WorkPool::Work::Poll() {
  if (gone_ && gone_()) {
    budget_.Cancel(why_);
    return true;
  }
  if (phase_ != Phase::kShort || ThreadSeconds() - begin_ < kShortWork) return false;
  std::unique_lock<std::mutex> lock(pool_->mutex_);
  const Count now = pool_->CountAll();
  if (now.running >= pool_->most_running_ && now.waiting >= pool_->most_waiting_) {
    refused_ = "busy: " + std::to_string(now.running) + " requests running, " +
               std::to_string(now.waiting) +
               " waiting, as many as ~threads and ~queue allow; ask again later, or see ~cancel";
    return true;
  }
  phase_ = Phase::kWaiting;
  while (!pool_->IsNext(*this)) {
    pool_->changed_.wait_for(lock, kPoll);
    if (budget_.cancelled() || budget_.elapsed() > max_seconds_) return false;  // the budget tells
    if (gone_) {
      lock.unlock();
      const bool gone = gone_();
      lock.lock();
      if (gone) {
        budget_.Cancel(why_);
        return true;
      }
    }
  }
  phase_ = Phase::kRunning;
  lock.unlock();
  StepBack();
  return false;
}

/// Is there a place, and nobody who has waited for longer?
bool WorkPool::IsNext(const Work& work) const {
  std::size_t running = 0;
  bool first = true, before = true;
  for (const Work* other : work_) {
    if (other == &work) before = false;
    running += other->phase_ == Work::Phase::kRunning;
    if (before && other->phase_ == Work::Phase::kWaiting) first = false;
  }
  return first && running < most_running_;
}

WorkPool::Count WorkPool::CountAll() const {
  Count count;
  std::ostringstream sentence;
  sentence.precision(3);
  for (const Work* work : work_) {
    if (work->phase_ == Work::Phase::kShort) continue;
    const bool waits = work->phase_ == Work::Phase::kWaiting;
    (waits ? count.waiting : count.running) += 1;
    sentence << (sentence.tellp() > 0 ? "; " : "") << work->name_ << " for "
             << work->budget_.elapsed() << " s" << (waits ? " (waiting)" : "");
  }
  count.sentence = sentence.str();
  return count;
}

WorkPool::Count WorkPool::Look() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return CountAll();
}

WorkPool::Count WorkPool::Cancel(const std::string& name, const std::string& reason) {
  std::unique_lock<std::mutex> lock(mutex_);
  Count count = CountAll();
  for (const Work* work : work_) {
    if (!name.empty() && work->name_ != name) continue;
    work->budget_.Cancel(reason);
    ++count.cancelled;
  }
  lock.unlock();
  changed_.notify_all();
  return count;
}

}  // namespace ros_interface
}  // namespace contact_flow
