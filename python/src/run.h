// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

#include "bindings.h"

namespace contact_flow {
namespace python {

/// One arc of a run, which it keeps.
struct ArcOf {
  std::shared_ptr<const Run> run;
  std::size_t index = 0;

  const Arc& get() const { return run->trajectory.arcs[index]; }
};

/// One transition of a run, which it keeps.
struct EventOf {
  std::shared_ptr<const Run> run;
  std::size_t index = 0;

  const Transition& get() const { return run->trajectory.transitions[index]; }
  const SystemDescription& description() const { return run->description(); }
};

}  // namespace python
}  // namespace contact_flow
