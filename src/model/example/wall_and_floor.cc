// SPDX-License-Identifier: BSD-3-Clause
#include "wall_and_floor.h"

#include "contact_flow/model/model_system.h"

namespace contact_flow {
template std::unique_ptr<MechanicalSystem> MakeSystem<example::WallAndFloor>(
    const ParameterValues&);
}  // namespace contact_flow
