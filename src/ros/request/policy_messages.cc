// SPDX-License-Identifier: BSD-3-Clause
#include "policy_messages.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "analysis_messages.h"
#include "contact_flow/io/map_reader.h"
#include "contact_flow/mode_text.h"
#include "contact_flow/model/configuration_factors.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"

namespace contact_flow {
namespace ros_interface {
namespace {

std::string At(const std::string& field, std::size_t k) {
  return field + "[" + std::to_string(k) + "]";
}

/// (q, v) as one.
Vector Joined(const std::string& field, const std::vector<double>& q, const std::vector<double>& v,
              const ConfigurationSpace& space) {
  if (q.size() != static_cast<std::size_t>(space.num_positions()) ||
      v.size() != static_cast<std::size_t>(space.dof())) {
    throw std::invalid_argument("q_" + field + " and v_" + field + " have " +
                                std::to_string(q.size()) + " and " + std::to_string(v.size()) +
                                " entries, expected " + std::to_string(space.num_positions()) +
                                " and " + std::to_string(space.dof()));
  }
  Vector x(static_cast<Eigen::Index>(q.size() + v.size()));
  x << FromMsg(q), FromMsg(v);
  return x;
}

PolicyPhase PhaseMsg(const ReferencePhase& phase, const std::vector<std::string>& constraints,
                     Eigen::Index nq) {
  PolicyPhase m;
  m.mode = phase.mode.Names(constraints);
  m.mode_word = ToWord(constraints, phase.mode);
  m.t_begin = phase.t_begin;
  m.t_end = phase.t_end;
  const Eigen::Index d = phase.x_begin.size() - nq;
  m.q_begin = ToMsg(VectorRef(phase.x_begin.head(nq)));
  m.v_begin = ToMsg(VectorRef(phase.x_begin.tail(d)));
  m.q_end = ToMsg(VectorRef(phase.x_end.head(nq)));
  m.v_end = ToMsg(VectorRef(phase.x_end.tail(d)));
  m.activated = phase.activated.Names(constraints);
  m.released = phase.released.Names(constraints);
  m.t = phase.t;
  m.q = ToMsg(MatrixRef(phase.x.topRows(nq).transpose()));
  m.v = ToMsg(MatrixRef(phase.x.bottomRows(d).transpose()));
  m.a = ToMsg(MatrixRef(phase.a.transpose()));
  return m;
}

ReferencePhase ToPhase(const PolicyPhase& m, const std::vector<std::string>& constraints,
                       const ConfigurationSpace& space) {
  ReferencePhase phase;
  phase.mode = ModeOfWord("mode_word", m.mode_word, static_cast<int>(constraints.size()));
  if (phase.mode.Names(constraints) != m.mode) {
    throw std::invalid_argument("mode is " +
                                SetOfNames("mode", m.mode, constraints).ToString(constraints) +
                                ", expected that of mode_word, '" + m.mode_word + "'");
  }
  phase.t_begin = m.t_begin;
  phase.t_end = m.t_end;
  phase.x_begin = Joined("begin", m.q_begin, m.v_begin, space);
  phase.x_end = Joined("end", m.q_end, m.v_end, space);
  phase.activated = SetOfNames("activated", m.activated, constraints);
  phase.released = SetOfNames("released", m.released, constraints);
  phase.t = m.t;
  const Matrix q = ToMatrix("q", m.q), v = ToMatrix("v", m.v);
  if (q.rows() != v.rows()) {
    throw std::invalid_argument("q has " + std::to_string(q.rows()) + " rows, v " +
                                std::to_string(v.rows()));
  }
  phase.x.resize(q.cols() + v.cols(), q.rows());
  phase.x << q.transpose(), v.transpose();
  phase.a = ToMatrix("a", m.a).transpose();
  return phase;
}

}  // namespace

Policy ToMsg(const TrackingPolicy& policy) {
  const PolicyNames& names = policy.names;
  const ExtendedReference& reference = policy.reference;
  Policy m;
  m.model = names.model;
  m.coordinates = names.coordinates;
  m.units = names.units;
  m.velocities = names.velocities;
  m.factors = FactorNames(reference.space());
  m.constraints = names.constraints;
  m.inputs = names.inputs;
  m.instants = reference.instants().Names(names.constraints);
  m.feed_forward.times = reference.inputs().grid;
  Matrix values(static_cast<Eigen::Index>(reference.inputs().values.size()),
                static_cast<Eigen::Index>(names.inputs.size()));
  for (Eigen::Index k = 0; k < values.rows(); ++k) {
    values.row(k) = reference.inputs().values[static_cast<std::size_t>(k)];
  }
  m.feed_forward.values = ToMsg(MatrixRef(values));
  for (std::size_t k = 0; k < policy.gains.size(); ++k) {
    PolicyGain gain;
    gain.phase = static_cast<std::uint32_t>(policy.gain_phases[k]);
    gain.kinked = std::count(policy.kinked.begin(), policy.kinked.end(), static_cast<int>(k)) > 0;
    gain.K = ToMsg(MatrixRef(policy.gains[k]));
    m.gains.push_back(gain);
  }
  for (const ReferencePhase& phase : reference.phases()) {
    m.phases.push_back(PhaseMsg(phase, names.constraints, reference.space().num_positions()));
  }
  m.lower = ToMsg(VectorRef(policy.lower.cwiseMax(-kLargestNumber)));  // no message has infinities
  m.upper = ToMsg(VectorRef(policy.upper.cwiseMin(kLargestNumber)));
  return m;
}

TrackingPolicy FromMsg(const Policy& m) {
  CheckMessage(m);
  ConfigurationSpace space = SpaceOfFactors("factors", m.factors);
  InputSchedule inputs;
  inputs.grid = m.feed_forward.times;
  const Matrix values = ToMatrix("feed_forward.values", m.feed_forward.values);
  for (Eigen::Index k = 0; k < values.rows(); ++k) inputs.values.push_back(values.row(k));
  std::vector<ReferencePhase> phases;
  for (const PolicyPhase& phase : m.phases) {
    try {
      phases.push_back(ToPhase(phase, m.constraints, space));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(At("phases", phases.size()) + "." + error.what());
    }
  }
  const ConstraintSet instants = SetOfNames("instants", m.instants, m.constraints);
  TrackingPolicy policy{
      {m.model, m.coordinates, m.units, m.velocities, m.constraints, m.inputs},
      ExtendedReference(std::move(space), std::move(inputs), std::move(phases), instants),
      {},
      {},
      {},
      {},
      {}};
  for (std::size_t k = 0; k < m.gains.size(); ++k) {
    policy.gains.push_back(ToMatrix(At("gains", k) + ".K", m.gains[k].K));
    policy.gain_phases.push_back(static_cast<int>(m.gains[k].phase));
    if (m.gains[k].kinked) policy.kinked.push_back(static_cast<int>(k));
  }
  policy.lower = FromMsg(m.lower);
  policy.upper = FromMsg(m.upper);
  CheckPolicy(policy);
  return policy;
}

}  // namespace ros_interface
}  // namespace contact_flow
