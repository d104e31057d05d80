// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/EnsembleCount.h"
#include "contact_flow/EnsembleRequest.h"
#include "contact_flow/EnsembleResult.h"
#include "contact_flow/ensemble/sweep.h"
#include "src/session/setup.h"
#include "watch.h"

namespace contact_flow {
namespace ros_interface {

/// The result of `sweep`, a function of setup and request alone unless it is cancelled or ended by
/// time: then that of the first `runs` of the request. Throws std::invalid_argument, naming the
/// field, for a request that is not in order.
EnsembleResult Answer(const Setup& setup, const EnsembleRequest& request, const Watch& watch = {});

/// Counts by RunOutcome, with their names.
std::vector<EnsembleCount> ToMsg(const std::map<int, std::uint64_t>& outcomes);

}  // namespace ros_interface
}  // namespace contact_flow
