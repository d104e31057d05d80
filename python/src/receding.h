// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

namespace contact_flow {
namespace python {

/// RecedingLoop, and System.receding_horizon.
void BindReceding(pybind11::module_* module);

}  // namespace python
}  // namespace contact_flow
