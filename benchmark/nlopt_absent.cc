// SPDX-License-Identifier: BSD-3-Clause
//
// Built in place of nlopt_peer.cc where NLopt is not installed.
#include "ball_problem.h"

namespace contact_flow {
namespace benchmark {

PeerOptimum RunNlopt(const BallProblem&, bool, double) { return {}; }

}  // namespace benchmark
}  // namespace contact_flow
