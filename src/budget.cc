// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/budget.h"

#include <atomic>
#include <chrono>
#include <cstdio>
#include <mutex>
#include <utility>

#include "src/clocks.h"

namespace contact_flow {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kMegabyte = 1e6;

thread_local BudgetScope* innermost = nullptr;

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.4g", value);
  return text;
}

}  // namespace

struct Budget::State {
  BudgetLimits limits;
  Clock::time_point begin = Clock::now();
  std::atomic<bool> cancelled{false};
  std::atomic<bool> told{false};
  mutable std::mutex mutex;
  std::string reason;  // of the cancellation, guarded by the mutex
};

Budget::Budget(BudgetLimits limits) : state_(std::make_shared<State>()) {
  state_->limits = std::move(limits);
}

void Budget::Cancel(const std::string& reason) const {
  const std::lock_guard<std::mutex> lock(state_->mutex);
  if (state_->cancelled) return;
  state_->reason = reason;
  state_->cancelled = true;
}

bool Budget::cancelled() const { return state_->cancelled; }
bool Budget::told() const { return state_->told; }
const BudgetLimits& Budget::limits() const { return state_->limits; }

double Budget::elapsed() const {
  return std::chrono::duration<double>(Clock::now() - state_->begin).count();
}

BudgetEnd Budget::Ask(std::string* sentence) const {
  if (!state_->cancelled && state_->limits.cancelled && state_->limits.cancelled()) {
    Cancel("the caller cancelled");
  }
  if (state_->cancelled) {
    state_->told = true;
    const std::lock_guard<std::mutex> lock(state_->mutex);
    if (sentence != nullptr) *sentence = state_->reason;
    return BudgetEnd::kCancelled;
  }
  const double used = elapsed();
  if (!(used > state_->limits.max_seconds)) return BudgetEnd::kNone;
  state_->told = true;
  if (sentence != nullptr) {
    *sentence = "max_seconds = " + Number(state_->limits.max_seconds) +
                " are used up; options.max_seconds may be raised";
  }
  return BudgetEnd::kSeconds;
}

BudgetScope::BudgetScope(const Budget& budget) : budget_(budget), outer_(innermost) {
  innermost = this;
}
BudgetScope::~BudgetScope() { innermost = outer_; }

BudgetStage::BudgetStage(const char* what, std::size_t total)
    : what_(what),
      total_(total),
      scope_(innermost),
      outer_(scope_ != nullptr ? scope_->stage_ : nullptr) {
  if (scope_ != nullptr) scope_->stage_ = this;
}
BudgetStage::~BudgetStage() {
  if (scope_ != nullptr) scope_->stage_ = outer_;
}

std::string BudgetStage::Describe() const {
  std::string text = outer_ != nullptr ? outer_->Describe() + ", " : "";
  text += what_;
  if (total_ > 0) {
    text += " (" + std::to_string(done_) + " of " + std::to_string(total_) + " done)";
  } else if (done_ > 0) {
    text += " (" + std::to_string(done_) + " done)";
  }
  return text;
}

bool HasBudget() { return innermost != nullptr; }

BudgetEnd LookAtBudget(std::string* sentence) {
  if (innermost == nullptr) return BudgetEnd::kNone;
  const BudgetEnd end = innermost->budget_.Ask(sentence);
  if (end != BudgetEnd::kNone && sentence != nullptr && innermost->stage_ != nullptr) {
    *sentence += "; it ended in: " + innermost->stage_->Describe();
  }
  return end;
}

bool BudgetEndWasTold() { return innermost != nullptr && innermost->budget_.told(); }

void AskBudget() {
  BudgetScope* const scope = innermost;
  if (scope == nullptr) return;
  const double now = CoarseSeconds();
  if (now < scope->next_) return;
  std::string sentence;
  const BudgetEnd end = LookAtBudget(&sentence);
  if (end != BudgetEnd::kNone) {
    scope->next_ = 0;
    throw BudgetExceeded(end, sentence);
  }
  scope->next_ = now + scope->budget_.limits().look_every;
}

void AskMemory(double bytes, const std::string& what) {
  if (innermost == nullptr) return;
  const double allowed = innermost->budget_.limits().max_megabytes;
  if (!(bytes > allowed * kMegabyte)) return;
  std::string sentence = "max_megabytes = " + Number(allowed) + " do not hold " + what +
                         ", which take " + Number(bytes / kMegabyte) +
                         " MB; options.max_megabytes may be raised";
  if (innermost->stage_ != nullptr) sentence += "; it ended in: " + innermost->stage_->Describe();
  throw BudgetExceeded(BudgetEnd::kMegabytes, sentence);
}

}  // namespace contact_flow
