// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace python {

/// What lets go of the interpreter's lock, counted. A thread that would take the lock again from an
/// interpreter that has ended is ended itself, in the middle of C++, which aborts the process: at
/// its exit the interpreter waits for all of it, and what is under way ends at its next look.
class Unlocking {
 public:
  /// Holds the lock. Throws std::runtime_error when the interpreter is about to end.
  Unlocking() {
    if (Ending()) throw std::runtime_error("the interpreter ends");
    ++Count();
  }
  ~Unlocking() { --Count(); }
  Unlocking(const Unlocking&) = delete;
  Unlocking& operator=(const Unlocking&) = delete;

  static std::atomic<bool>& Ending() {
    static std::atomic<bool> ending{false};
    return ending;
  }
  /// For atexit, with the lock: waits until nothing is unlocked, 10 s at most.
  static void End() {
    Ending() = true;
    const pybind11::gil_scoped_release release;
    for (int k = 0; k < 1000 && Count() > 0; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

 private:
  static std::atomic<int>& Count() {
    static std::atomic<int> count{0};
    return count;
  }
};

inline constexpr double kForever = std::numeric_limits<double>::infinity();  // [s]

/// While it lives, the thread does not hold the interpreter's lock, and what it computes ends soon
/// after Ctrl-C, or after `max_seconds` [s], by a budget. A signal is looked for every 50 ms.
class Unlocked {
 public:
  explicit Unlocked(double max_seconds = kForever) : scope_(Budget(Limits(max_seconds))) {}

  /// Throws what a signal handler has raised, KeyboardInterrupt mostly.
  void Rethrow() {
    if (!raised_) return;
    pybind11::gil_scoped_acquire acquire;
    pybind11::error_already_set raised = std::move(*raised_);
    raised_.reset();
    throw raised;
  }

 private:
  BudgetLimits Limits(double max_seconds) {
    BudgetLimits limits;
    limits.max_seconds = max_seconds;
    limits.look_every = 0.05;
    limits.cancelled = [this] {
      if (Unlocking::Ending()) return true;
      if (!looked_.exchange(true)) return false;  // the interpreter has just looked itself
      pybind11::gil_scoped_acquire acquire;
      if (PyErr_CheckSignals() != 0) raised_.emplace();
      return raised_.has_value();
    };
    return limits;
  }

  Unlocking unlocking_;
  std::atomic<bool> looked_{false};
  std::optional<pybind11::error_already_set> raised_;
  pybind11::gil_scoped_release release_;
  BudgetScope scope_;
};

/// work() without the interpreter's lock. Throws what a signal handler has raised meanwhile, and
/// BudgetExceeded after `max_seconds` [s] where `work` does.
template <class Work>
auto WithoutLock(Work&& work, double max_seconds = kForever) {
  Unlocked unlocked(max_seconds);
  try {
    auto result = work();
    unlocked.Rethrow();
    return result;
  } catch (...) {
    unlocked.Rethrow();  // instead of what it led to
    throw;
  }
}

}  // namespace python
}  // namespace contact_flow
