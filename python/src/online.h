// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "convert.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {

/// An OnlineFlow, one thread at a time, with the derivative since its mark.
struct Online {
  std::shared_ptr<const System> system;
  SimulateOptions options;
  std::unique_ptr<OnlineFlow> flow;
  std::unique_ptr<RollingDerivative> rolling;  // none without a mark
  std::mutex mutex;

  const SystemDescription& description() const { return system->description(); }

  /// The derivative goes on to now; a mark that was interrupted on its way is lost.
  void Follow(bool passed) {
    if (!rolling) return;
    try {
      rolling->Follow(flow.get(), passed);
    } catch (...) {
      Unmark();
      throw;
    }
  }
  void Unmark() {
    rolling.reset();
    flow->KeepMotion(false);
  }
};

template <class Work>
auto Alone(Online& online, Work&& work) {
  return WithoutLock([&] {
    const std::lock_guard<std::mutex> lock(online.mutex);
    return work(*online.flow);
  });
}

/// mark, unmark and tangents of the class OnlineFlow.
void BindRolling(py::module_* module);

}  // namespace python
}  // namespace contact_flow
