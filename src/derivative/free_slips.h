// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/derivative/variation.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"

namespace contact_flow {

/// Not kOk where a contact of the arc's mode has the coefficient 0, which is a variable, and does
/// not slip one way all along the arc: which way friction would act is not decided.
Status CheckFreeSlips(const ContactDynamics& dynamics, const Arc& arc);

}  // namespace contact_flow
