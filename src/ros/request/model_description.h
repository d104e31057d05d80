// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/ModelDescription.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// Number of output samples of a request that names none, and the most it may ask for.
inline constexpr int kDefaultSamples = 200;
inline constexpr int kMaxSamples = 100000;

/// The setup as a message (header empty), and back: what is needed to repeat a run.
ModelDescription ToMsg(const Setup& setup);
Configuration FromMsg(const ModelDescription& description);

}  // namespace ros_interface
}  // namespace contact_flow
