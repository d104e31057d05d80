// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "contact_flow/ensemble/sweep.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {

/// Runs from the nominal state of a shipped model, on two threads.
inline SweepRequest Nominal(const std::string& model, std::uint64_t count) {
  SweepRequest request;
  request.system = MakeModel(model, {});
  request.make = [model](const ParameterValues& values) { return MakeModel(model, values); };
  request.x = request.system->nominal().x;
  request.inputs = InputSchedule::Constant(request.system->nominal().u);
  request.duration = request.system->nominal().duration;
  request.count = count;
  request.threads = 2;
  return request;
}

inline DrawPart Uniform(std::vector<std::string> names, Vector low, Vector high) {
  DrawPart part;
  part.names = std::move(names);
  part.low = std::move(low);
  part.high = std::move(high);
  return part;
}

}  // namespace contact_flow
