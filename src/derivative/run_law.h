// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "event_laws.h"
#include "run_preparation.h"

namespace contact_flow {

/// Holds the derivative to B(F(x₀)) = F(x(T)): a run that is late by δt is late to its end. What is
/// left at each transition, B_k(F⁻) − F⁺, may be small and grow on its way to T where contacts are
/// slow: it is carried there along a selection of each event. `residuals` belong to the
/// events of the derivative, whose Trust::event_law grows. Not kOk, with the transition that counts
/// most, where the law fails. Costs nothing where all residuals are rounding.
Status CheckRunLaw(const Trajectory& trajectory, std::size_t first,
                   const std::vector<EventResidual>& residuals, const ArcProduct& carry,
                   BDerivative* derivative);

}  // namespace contact_flow
