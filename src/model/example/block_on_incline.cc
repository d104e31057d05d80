// SPDX-License-Identifier: BSD-3-Clause
#include "block_on_incline.h"

#include "contact_flow/model/model_system.h"

namespace contact_flow {
template std::unique_ptr<MechanicalSystem> MakeSystem<example::BlockOnIncline>(
    const ParameterValues&);
}  // namespace contact_flow
