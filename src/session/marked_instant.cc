// SPDX-License-Identifier: BSD-3-Clause
#include "marked_instant.h"

#include <stdexcept>

#include "contact_flow/flow/manifold_projection.h"

namespace contact_flow {

MarkedInstant::MarkedInstant(const Setup& setup, OnlineFlow* flow, const AskedMark& asked) {
  BDerivativeOptions options = setup.derivative_options;
  options.variables = ResolveVariables(setup, asked.by_inputs, asked.by_parameters);
  ResolvedRun run;
  run.x = flow->State();
  ProjectContacts(*setup.system, flow->mode(), &run.x);
  run.input = InputSchedule::Constant(flow->NextInput());
  run.options = setup.options;
  directions_ = ResolveDirections(setup, run, asked.directions, options.variables);
  if (directions_.vectors.empty()) {
    throw std::invalid_argument("directions: none is admitted by the present contact mode");
  }
  Matrix columns(directions_.vectors.front().size(),
                 static_cast<Eigen::Index>(directions_.vectors.size()));
  for (std::size_t j = 0; j < directions_.vectors.size(); ++j) {
    columns.col(static_cast<Eigen::Index>(j)) = directions_.vectors[j];
  }
  rolling_ = std::make_unique<RollingDerivative>(flow, columns, options, setup.options);
}

MarkReading MarkedInstant::Read(OnlineFlow* flow) {
  return {rolling_->mark(), directions_.names, rolling_->directions(), rolling_->Read(flow)};
}

}  // namespace contact_flow
