// SPDX-License-Identifier: BSD-3-Clause
//
// Built in place of the CVODES peers where SUNDIALS is not installed.
#include "peer.h"

namespace contact_flow {
namespace benchmark {

std::unique_ptr<Peer> MakeCvodesAdams(const Scenario&) { return nullptr; }

std::unique_ptr<JacobianPeer> MakeCvodesSensitivities(const Scenario&) { return nullptr; }

}  // namespace benchmark
}  // namespace contact_flow
