// SPDX-License-Identifier: BSD-3-Clause
#include "ball_in_corner.h"

#include "contact_flow/model/model_system.h"

namespace contact_flow {
template std::unique_ptr<MechanicalSystem> MakeSystem<example::BallInCorner>(
    const ParameterValues&);
}  // namespace contact_flow
