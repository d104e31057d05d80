// SPDX-License-Identifier: BSD-3-Clause
#include "model_description.h"

#include "request.h"
#include "src/ros/message/conversions.h"

namespace contact_flow {
namespace ros_interface {

ModelDescription ToMsg(const Setup& setup) {
  const SystemDescription& d = setup.system->description();
  const NominalRun& nominal = setup.system->nominal();
  const Eigen::Index dof = setup.system->dof(), nq = setup.system->num_positions();
  ModelDescription m;
  m.name = d.name;
  m.summary = d.summary;
  m.coordinates = d.coordinates;
  m.units = d.units;
  m.velocities = d.velocities;
  m.bilateral = d.bilateral;
  m.constraints = d.constraints;
  m.restitution = ToMsg(VectorRef(setup.system->restitution()));
  for (int i = 0; i < setup.system->num_constraints(); ++i) {
    const bool given = setup.system->HasFriction();
    m.friction.push_back(given ? setup.system->friction()[i].coefficient : 0);
  }
  m.tangential = TangentialNames(*setup.system);
  m.inputs = d.inputs;
  for (const Parameter& parameter : d.parameters) {
    m.parameters.emplace_back();
    m.parameters.back().name = parameter.name;
    m.parameters.back().unit = parameter.unit;
    m.parameters.back().meaning = parameter.meaning;
    m.parameters.back().value = parameter.value;
  }
  m.nominal_q = ToMsg(VectorRef(nominal.x.head(nq)));
  m.nominal_v = ToMsg(VectorRef(nominal.x.tail(dof)));
  m.nominal_input = ToMsg(VectorRef(nominal.u));
  m.nominal_duration = nominal.duration;
  m.options = ToMsg(setup.options);
  m.derivative_options = ToMsg(setup.derivative_options);
  m.samples = kDefaultSamples;
  if (setup.robot != nullptr) {
    m.urdf = setup.configuration.robot.urdf;
    m.robot_yaml = setup.configuration.robot.yaml;
    m.warnings = setup.robot->robot().model.warnings;
  }
  return m;
}

Configuration FromMsg(const ModelDescription& description) {
  Configuration c;
  c.model = description.name;
  c.robot.urdf = description.urdf;
  c.robot.yaml = description.robot_yaml;
  for (const ModelParameter& p : description.parameters) c.parameters[p.name] = p.value;
  c.options = ResolveOptions(c.options, description.options);
  c.options.max_step = description.options.max_step;
  c.derivative_options = ResolveOptions(c.derivative_options, description.derivative_options);
  return c;
}

}  // namespace ros_interface
}  // namespace contact_flow
