// SPDX-License-Identifier: BSD-3-Clause
#include "legged_table.h"

#include "contact_flow/model/model_system.h"

namespace contact_flow {
template std::unique_ptr<MechanicalSystem> MakeSystem<example::LeggedTable>(const ParameterValues&);
}  // namespace contact_flow
