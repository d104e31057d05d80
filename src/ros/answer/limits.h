// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace contact_flow {

/// What several services take: more, or less, is refused with the field's name.
constexpr double kMinHorizon = 1e-9, kMaxHorizon = 1e6;  // [s]
constexpr double kLargestTolerance = 1e3;                // of a search
constexpr int kMaxIterations = 100000;                   // of a search
constexpr int kMaxWordLength = 1000, kMaxWords = 10000000, kMaxPrograms = 100000000;
constexpr int kMaxMapSize = 64;  // of a map: a quadratic norm of it has 2080 unknowns

/// What they remark upon.
constexpr double kNeutral = 1e-6;  // a larger residual: no symmetry

}  // namespace contact_flow
