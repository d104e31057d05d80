// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "convert.h"

namespace contact_flow {
namespace python {

/// A direction of a system, by (δq, δv) and `variables`: numbers (δq, δv, δu, δp) or (δq, δv)
/// alone, a dict of some by name, "+name" or "-name".
Vector ToDirection(const MechanicalSystem& system, const Variables& variables, const py::handle& w);

/// Throws ValueError for a direction in which no run may start.
void CheckAdmitted(const StartDirections& directions, const Vector& w, const std::string& name);

}  // namespace python
}  // namespace contact_flow
