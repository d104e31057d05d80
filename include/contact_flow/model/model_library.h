// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {

/// Names of all analytic models, sorted.
std::vector<std::string> ModelNames();

/// Makes the model of that name. Throws std::invalid_argument, with the nearest valid name, for an
/// unknown model or parameter, and with field and value for a number that is out of its range.
std::unique_ptr<MechanicalSystem> MakeModel(const std::string& name,
                                            const ParameterValues& parameters = {});

}  // namespace contact_flow
