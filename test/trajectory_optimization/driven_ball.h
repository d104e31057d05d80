// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace contact_flow {
namespace test {

/// Of the model driven_ball.
inline constexpr double kBallGravity = 9.8, kBallRestitution = 0.7;

}  // namespace test
}  // namespace contact_flow
