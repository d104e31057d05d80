// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "requirements.h"
#include "scenario.h"

namespace contact_flow {
namespace benchmark {

/// Each prints one part of the report and adds what must hold.

/// Error, right-hand sides and time of a run, ours and the peers', at equal error.
void ReportPlainRuns(const Scenario& scenario, Requirements* requirements);
/// The Jacobian of the outcome, in units of our plain run at the same tolerance.
void ReportJacobians(const Scenario& scenario, double limit, Requirements* requirements);
/// All pieces of a simultaneous touchdown against one.
void ReportPieces(const Scenario& scenario, Requirements* requirements);
/// Heap allocations of a run and of one with four times the steps.
void ReportAllocations(const Scenario& scenario, Requirements* requirements);

}  // namespace benchmark
}  // namespace contact_flow
