// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

#include <limits>
#include <optional>
#include <utility>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace python {

/// While it lives, the thread does not hold the interpreter's lock, and what it computes ends soon
/// after Ctrl-C, or after `max_seconds` [s], by a budget. A signal is looked for every 50 ms.
class Unlocked {
 public:
  explicit Unlocked(double max_seconds = std::numeric_limits<double>::infinity())
      : scope_(Budget(Limits(max_seconds))) {}

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
      pybind11::gil_scoped_acquire acquire;
      if (PyErr_CheckSignals() != 0) raised_.emplace();
      return raised_.has_value();
    };
    return limits;
  }

  std::optional<pybind11::error_already_set> raised_;
  pybind11::gil_scoped_release release_;
  BudgetScope scope_;
};

/// work() without the interpreter's lock. Throws what a signal handler has raised meanwhile, and
/// BudgetExceeded after `max_seconds` [s] where `work` does.
template <class Work>
auto WithoutLock(Work&& work, double max_seconds = std::numeric_limits<double>::infinity()) {
  Unlocked unlocked(max_seconds);
  try {
    auto result = work();
    unlocked.Rethrow();
    return result;
  } catch (...) {
    unlocked.Rethrow();   // instead of what it led to
    throw;
  }
}

}  // namespace python
}  // namespace contact_flow
