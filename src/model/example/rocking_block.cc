// SPDX-License-Identifier: BSD-3-Clause
#include "rocking_block.h"

#include "contact_flow/model/model_system.h"

namespace contact_flow {
template std::unique_ptr<MechanicalSystem> MakeSystem<example::RockingBlock>(
    const ParameterValues&);
}  // namespace contact_flow
