// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

/// What a Flow and the lanes of a batch take their steps by.
namespace contact_flow {

inline constexpr double kSafety = 0.8;  // measured: shorter steps, but hardly a rejected one
/// Measured: the first guess is about half the step that follows.
inline constexpr double kFirstStep = 1.5;
/// Of the step size (Hairer's values).
inline constexpr double kLargestGrowth = 6, kSmallestGrowth = 1.0 / 3;
/// Relative to max(1, t): nothing is resolved below.
inline constexpr double kSmallestStep = 1e-14;
/// A step whose error is below this could be more than four times as long.
inline constexpr double kFreeError = 1e-6;
/// A gap that opens again this many floors above zero cannot be told from one that touches.
inline constexpr double kTouchReach = 10;
/// Rounding of a gap, relative to |Da||q|.
inline constexpr double kGapNoise = 1e-15;
/// Part of a step that is repeated for a guard's sake.
inline constexpr double kLeastPart = 0.1, kLargestPart = 0.9;
/// The same where its zero was none.
inline constexpr double kPhantomPart = 0.3;
/// A gap that is deeper penetrates, of the gap's and the absolute tolerance.
inline constexpr double kDeep = 100, kUnresolved = 10;
/// An event is moved this far by one Euler step, of the step that holds it and at most [s]: error
/// ~1e-18 beside motion that takes a second.
inline constexpr double kTaylorPart = 1e-7, kTaylorReach = 1e-9;
inline double EulerReach(double length) { return std::min(kTaylorReach, kTaylorPart * length); }
inline constexpr int kMaxNewton = 40;  // steps towards an event: a double zero takes most
/// A gap that falls by less than this part of a floor before it opens again stands still: a contact
/// that was let go together with others has a speed of the order of rounding.
inline constexpr double kStandsStill = 1e-3;
/// A force at an event is below this part of what it was where the step began; unless the step is
/// as short as this, relative to max(1, t): where forces jump, they do so here.
inline constexpr double kPhantom = 0.1, kShortest = 1e-12;
/// Steps that stability limits until the implicit method takes over, and those in a row that
/// accuracy limits after which none counts (Hairer & Wanner II, Sec. IV.2: 15 and 6).
inline constexpr int kStiffSteps = 10, kOthers = 4;
/// A force is excluded when its smallest stage value exceeds this many times its range over the
/// stages: a sinusoid of any frequency up to 2000 periods a step falls at most 2.1 ranges below.
inline constexpr double kForceReserve = 4;
/// A margin is told by values at nodes where the smallest one exceeds this part of their range.
inline constexpr double kForceMargin = 0.5;
/// The error of a force's interpolant that resolves it, as a part of its range over the stages.
inline constexpr double kForceResolved = 0.05;
/// A force is zero where it pulls by this part of what moves its gap by the tolerance in one step.
inline constexpr double kQuietPull = 1e-6;
/// Gaps are put back beyond this part of the absolute tolerance, rates also beyond the second part
/// of what counts as rest at a start. In runs of some seconds nothing comes so far.
inline constexpr double kDrift = 0.1, kSlowDrift = 1e-2;
inline constexpr double kImpliedReach = 10;  // [absolute tolerances] an implied contact may drift
/// A step's end is at most so many tolerances beside closed loops: further away is another branch.
inline constexpr double kLeap = 1e3;
/// Events so close do not go on: relative to the time, or to what counts as simultaneous.
inline constexpr double kNoTime = 1e-14, kNoTimeApart = 1e-2, kLongestStall = 1e-9;  // [s] the last
/// Events in a row for each constraint, without time or motion between them, that end a run.
inline constexpr int kStallsForEach = 4;
inline int LongestCrowd(int num_constraints) { return kStallsForEach * (num_constraints + 4); }
/// An event that has come again at one time so often is decided the other way.
inline constexpr int kStallsToInsist = 2;

}  // namespace contact_flow
