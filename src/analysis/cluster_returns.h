// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/event_map.h"

namespace contact_flow {

/// Contacts that an event of a cluster sets into flight, by its impact: they are back after
/// 2 r/−ä, r = Da_i v behind it and ä in the mode until the next event of the cluster. The run
/// perturbed along w, between whose events time grows with α, has to be at the next one before.
/// Without friction; nothing where the map has no piece along w.
void ConsiderReturns(const MechanicalSystem& system, const EventMap& event, const VectorRef& w,
                     ValidityRadius* smallest);

}  // namespace contact_flow
