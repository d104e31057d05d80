// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

namespace contact_flow {

/// What one request may take, whatever it is made of.
struct BudgetLimits {
  double max_seconds = std::numeric_limits<double>::infinity();    ///< by the clock [s]
  double max_megabytes = std::numeric_limits<double>::infinity();  ///< of any one thing [10⁶ byte]
  /// Asked now and then, by the thread that works; returning true cancels for good.
  std::function<bool()> cancelled;
  double look_every = 2e-3;  ///< least time from one look at all this to the next [s]
};

/// What ended the work.
enum class BudgetEnd { kNone = 0, kSeconds, kMegabytes, kCancelled };

/// Thrown where a budget is asked and there is none left. What has been computed by then is of no
/// use; public functions with a Status turn this into Outcome::kBudgetExceeded or kCancelled.
class BudgetExceeded : public std::runtime_error {
 public:
  /// Thrown where the budget ends, with the sentence that says so.
  BudgetExceeded(BudgetEnd end, const std::string& sentence)
      : std::runtime_error(sentence), end_(end) {}
  /// What ended the work.
  BudgetEnd end() const { return end_; }

 private:
  BudgetEnd end_;
};

/// The budget of a request, counted from its construction: a token. Copies are the same budget.
/// Threads may share it, and any of them may cancel it.
class Budget {
 public:
  /// Begins to count now.
  explicit Budget(BudgetLimits limits = {});

  /// Ends whatever works under it, within the time between two questions. The first reason stays.
  void Cancel(const std::string& reason) const;
  /// Whether it was cancelled.
  bool cancelled() const;
  /// What it allows.
  const BudgetLimits& limits() const;
  double elapsed() const;  ///< [s]
  /// Why there is nothing left; "" while there is. What has once run out stays so.
  BudgetEnd Ask(std::string* sentence) const;
  /// Whether that has been answered to anyone: what was made under it may be unfinished, whatever
  /// it says. False for what was finished before anyone asked again.
  bool told() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

/// While it lives, what its thread computes is within `budget`. Scopes nest; the innermost counts.
/// Nothing that is computed depends on a budget, but whether it is.
class BudgetScope {
 public:
  /// `budget` is that of this thread until the scope ends.
  explicit BudgetScope(const Budget& budget);
  ~BudgetScope();
  BudgetScope(const BudgetScope&) = delete;
  BudgetScope& operator=(const BudgetScope&) = delete;

 private:
  friend BudgetEnd LookAtBudget(std::string* sentence);
  friend void AskBudget();
  friend bool HasBudget();
  friend bool BudgetEndWasTold();
  friend void AskMemory(double bytes, const std::string& what);
  friend class BudgetStage;

  const Budget budget_;
  BudgetScope* const outer_;
  const class BudgetStage* stage_ = nullptr;
  double next_ = 0;  // when to look again, by the coarse clock [s]
};

/// Names what is being done, for the sentence of a budget that ends meanwhile: "in the arcs, 3 of
/// 12". `what` must outlive it.
class BudgetStage {
 public:
  /// `what` is being done, `total` times if that is known.
  explicit BudgetStage(const char* what, std::size_t total = 0);
  ~BudgetStage();
  BudgetStage(const BudgetStage&) = delete;
  BudgetStage& operator=(const BudgetStage&) = delete;

  /// Counts one.
  void Next() { ++done_; }
  std::string Describe() const;  ///< "all pieces (3 of 24 done)", for messages

 private:
  const char* const what_;
  const std::size_t total_;
  std::size_t done_ = 0;
  BudgetScope* const scope_;
  const BudgetStage* const outer_;
};

/// True where this thread works within a budget.
bool HasBudget();
/// Throws BudgetExceeded when the budget of this thread is used up. Ten nanoseconds: to be asked in
/// every loop whose length is not known, at least every 10 ms.
void AskBudget();
/// The same without throwing, looking at the clock.
BudgetEnd LookAtBudget(std::string* sentence);
/// Whether anyone was told that the budget of this thread is used up (Budget::told).
bool BudgetEndWasTold();
/// Before `bytes` are allocated for `what` ("the matrices of 40320 pieces"): throws BudgetExceeded,
/// with the figures, where that is more than max_megabytes.
void AskMemory(double bytes, const std::string& what);

}  // namespace contact_flow
