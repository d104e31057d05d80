// SPDX-License-Identifier: BSD-3-Clause
#include "mark.h"

#include <stdexcept>

#include "contact_flow/flow/manifold_projection.h"
#include "src/ros/message/conversions.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {

MarkedInstant::MarkedInstant(const Setup& setup, OnlineFlow* flow, const SimulatorMark& asked)
    : setup_(setup) {
  BDerivativeOptions options = setup.derivative_options;
  options.variables = ResolveVariables(setup, asked.by_inputs, asked.by_parameters);
  Run run;
  run.x = flow->State();
  ProjectContacts(*setup.system, flow->mode(), &run.x);
  run.input = InputSchedule::Constant(flow->NextInput());
  run.options = setup.options;
  directions_ = ResolveDirections(setup, run, asked.directions, asked.direction_matrix,
                                  asked.project_directions, options.variables);
  if (directions_.vectors.empty()) {
    throw std::invalid_argument("directions: none is admitted by the present contact mode");
  }
  Matrix columns(directions_.vectors.front().size(),
                 static_cast<Eigen::Index>(directions_.vectors.size()));
  for (std::size_t j = 0; j < directions_.vectors.size(); ++j) {
    columns.col(static_cast<Eigen::Index>(j)) = directions_.vectors[j];
  }
  rolling_ = std::make_unique<RollingDerivative>(flow, columns, options,
                                                 setup.options);
}

RollingTangents MarkedInstant::Message(OnlineFlow* flow) {
  const RollingDerivative::Reading now = rolling_->Read(flow);
  RollingTangents message;
  message.t_mark = rolling_->mark();
  message.t = now.t;
  message.velocities = setup_.system->description().velocities;
  message.direction_names = directions_.names;
  message.directions = ToMsg(MatrixRef(rolling_->directions().transpose()));
  message.tangents = ToMsg(MatrixRef(now.tangents.transpose()));
  message.time_derivative = ToMsg(VectorRef(now.time));
  message.outcome = static_cast<std::uint8_t>(now.status.outcome);
  message.message = now.status.message;
  return message;
}

}  // namespace ros_interface
}  // namespace contact_flow
