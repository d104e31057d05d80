// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {

/// The system of a template model. Only declared here, so that users of many models do not pay for
/// their nested duals (10 s and more each): src/model/example/X.cc instantiates it for example::X.
template <class Model>
std::unique_ptr<MechanicalSystem> MakeSystem(const ParameterValues& parameters);

}  // namespace contact_flow
