// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "contact_flow/ResultWarning.h"
#include "contact_flow/flow/trajectory.h"
#include "src/session/directions.h"
#include "src/session/notes.h"

/// Warnings of results: a code for scripts in `warnings`, and the sentence in `message`, too.
namespace contact_flow {
namespace ros_interface {

/// `t` [s] of the event that it is about; without one, or where it is not known (NaN), −1.
ResultWarning MakeWarning(std::uint8_t code, const std::string& message, double t = -1);

/// What became of directions.
std::vector<ResultWarning> ToMsg(const std::vector<DirectionNote>& notes);

/// What a run has gone on from.
std::vector<ResultWarning> ToMsg(const std::vector<Warning>& warnings);

template <class Result>
void Warn(const ResultWarning& warning, Result* result) {
  result->warnings.push_back(warning);
  AddNote(warning.message, &result->message);
}

/// Many at once; the message has their summary.
template <class Result>
void Warn(const std::vector<ResultWarning>& warnings, Result* result) {
  result->warnings.insert(result->warnings.end(), warnings.begin(), warnings.end());
  AddNote(SummaryOf(warnings), &result->message);
}

/// Which directions were left out or projected, with all sentences.
template <class Result>
void WarnOfDirections(const Directions& directions, Result* result) {
  for (const ResultWarning& warning : ToMsg(directions.notes)) Warn(warning, result);
}

/// What the run has gone on from, for a result made from it.
template <class Result>
void WarnOfRun(const Trajectory& trajectory, Result* result) {
  Warn(ToMsg(trajectory.warnings), result);
}

}  // namespace ros_interface
}  // namespace contact_flow
