// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/EnsembleRequest.h"
#include "contact_flow/ensemble/sweep.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// Most quantiles, histograms, costs and draws of one request, and most threads.
inline constexpr std::size_t kMaxEnsembleParts = 1000;
inline constexpr std::uint32_t kMaxEnsembleThreads = 64;

/// What a request asks `sweep`, all defaults filled in; `setup` must outlive it. Runs are limited
/// by steps alone: those ended by a clock would come out otherwise when they are repeated. Throws
/// std::invalid_argument, naming field and value, for what is not in order.
SweepRequest ResolveEnsemble(const Setup& setup, const EnsembleRequest& request);
/// The probabilities of its quantiles.
std::vector<double> ResolveProbabilities(const EnsembleRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
