// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <iosfwd>
#include <string>

#include "contact_flow/trajectory_optimization/policy.h"

namespace contact_flow {

/// Longest file of a policy [bytes].
inline constexpr std::size_t kMaxPolicyBytes = std::size_t{1} << 27;

/// Writes a policy as YAML, which needs no model to be read: names, grid and feed-forward, phases
/// with both one-sided states of their events, gains with the phase that each is of. Numbers have
/// 17 digits, so that reading them gives the same bits back. Throws as CheckPolicy does, before
/// anything is written.
void WritePolicy(const TrackingPolicy& policy, std::ostream* out);

/// The policy of such a text; `name` is what messages call it. Throws std::invalid_argument, naming
/// key, value and line, for one that is not in order.
TrackingPolicy ReadPolicy(const std::string& text, const std::string& name);

/// The same of a file.
TrackingPolicy ReadPolicyFile(const std::string& path);

/// Columns of `rows` numbers each, from a list of all, column by column. Throws
/// std::invalid_argument, naming the field, for another number of them.
Matrix ColumnsOf(const std::string& field, const std::vector<double>& numbers, Eigen::Index rows);

}  // namespace contact_flow
