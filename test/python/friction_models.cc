// SPDX-License-Identifier: BSD-3-Clause
// A library of models in C++ with friction, which registers them when Python loads it.
#include "contact_flow/model/model_registry.h"
#include "test/friction/systems/block.h"
#include "test/friction/systems/puck.h"

namespace {
[[maybe_unused]] const bool registered = [] {
  contact_flow::RegisterModels({contact_flow::EntryOf<contact_flow::test::Block>(),
                                contact_flow::EntryOf<contact_flow::test::Puck>()},
                               "friction_models");
  return true;
}();
}  // namespace
