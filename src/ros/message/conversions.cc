// SPDX-License-Identifier: BSD-3-Clause
#include "conversions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/corner_functions.h"
#include "contact_flow/io/configuration.h"
#include "contact_flow/io/samples.h"
#include "contact_flow/model/row_layout.h"
#include "geometry.h"
#include "warnings.h"

namespace contact_flow {
namespace ros_interface {

RunMargins ToMsg(const Margins& margins) {
  RunMargins m;
  m.approach_speed = margins.approach_speed;
  m.release_rate = margins.release_rate;
  m.gap = margins.gap;
  m.force = margins.force;
  m.event_interval = margins.event_interval;
  m.cluster_spread = margins.cluster_spread;
  return m;
}

geometry_msgs::Wrench ToMsg(const Eigen::Vector3d& force, const Eigen::Vector3d& torque) {
  geometry_msgs::Wrench m;
  m.force = ToVector(force);
  m.torque = ToVector(torque);
  return m;
}

ContactTransition ToMsg(const SystemDescription& description, const Transition& transition) {
  const Names& constraints = description.constraints;
  const auto nq = static_cast<Eigen::Index>(description.coordinates.size());
  const auto d = static_cast<Eigen::Index>(description.velocities.size());
  ContactTransition m;
  m.t = transition.t;
  m.mode_before = transition.mode_before.Names(constraints);
  m.mode_after = transition.mode_after.Names(constraints);
  m.mode_words = ToWords(constraints, {transition.mode_before, transition.mode_after});
  m.activated = transition.activated.Names(constraints);
  m.released = transition.released.Names(constraints);
  m.q = ToMsg(VectorRef(transition.x_minus.head(nq)));
  m.v_before = ToMsg(VectorRef(transition.x_minus.tail(d)));
  m.v_after = ToMsg(VectorRef(transition.x_plus.tail(d)));
  m.impulse = ToMsg(VectorRef(transition.impulse.head(constraints.size())));
  m.tangential_impulse = Tangential(description, transition.impulse);
  if (!m.tangential_impulse.empty()) {
    m.impulse_word = ToWord(constraints, transition.impulse_word);
    m.energy_change = transition.energy_change;
  }
  m.spread = transition.spread;
  m.completes_zeno = transition.completes_zeno;
  m.switched = transition.switched.Names(constraints);
  return m;
}

std::vector<double> ToMsg(const VectorRef& vector) {
  return std::vector<double>(vector.data(), vector.data() + vector.size());
}

Vector FromMsg(const std::vector<double>& numbers) {
  return Eigen::Map<const Vector>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

RowMajorMatrix ToMsg(const MatrixRef& matrix) {
  RowMajorMatrix m;
  m.rows = static_cast<std::uint32_t>(matrix.rows());
  m.cols = static_cast<std::uint32_t>(matrix.cols());
  m.data.reserve(static_cast<std::size_t>(matrix.size()));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) m.data.push_back(matrix(i, j));
  }
  return m;
}

SimulationOptions ToMsg(const SimulateOptions& options) {
  SimulationOptions m;
  m.relative_tolerance = options.relative_tolerance;
  m.absolute_tolerance = options.absolute_tolerance;
  m.max_step = options.max_step;
  m.simultaneity_tolerance = options.simultaneity_tolerance;
  m.gap_tolerance = options.gap_tolerance;
  m.speed_tolerance = options.speed_tolerance;
  m.zeno_interval = options.zeno_interval;
  m.max_steps = options.max_steps;
  m.max_events = options.max_events;
  m.max_seconds = options.max_seconds;
  m.max_megabytes = options.max_megabytes;
  m.complete_zeno = options.complete_zeno;
  m.impact_law = ImpactLawNames()[static_cast<std::size_t>(options.impact_law)];
  m.method = IntegrationMethodNames()[static_cast<std::size_t>(options.method)];
  return m;
}

DerivativeOptions ToMsg(const BDerivativeOptions& options) {
  DerivativeOptions m;
  m.tolerance = options.tolerance;
  m.kink_tolerance = options.kink_tolerance;
  m.max_activations_for_pieces = options.max_activations_for_pieces;
  m.max_pieces = options.max_pieces;
  return m;
}

DerivativePiece ToMsg(const LinearPiece& piece) {
  DerivativePiece m;
  m.matrix = ToMsg(MatrixRef(piece.matrix));
  m.cone = ToMsg(MatrixRef(piece.cone));
  for (const Names& order : piece.omega) {
    m.omega.emplace_back();
    m.omega.back().names = order;
  }
  m.eta = piece.eta;
  m.mode_words = piece.words;
  return m;
}

ContactTrajectory ToMsg(const SystemDescription& description, const Trajectory& trajectory,
                        double duration, int count) {
  const auto nq = static_cast<Eigen::Index>(description.coordinates.size());
  const auto d = static_cast<Eigen::Index>(description.velocities.size());
  ContactTrajectory m;
  m.model = description.name;
  m.coordinates = description.coordinates;
  m.velocities = description.velocities;
  m.constraints = description.constraints;
  m.outcome = static_cast<std::uint8_t>(trajectory.status.outcome);
  m.message = trajectory.status.message;
  WarnOfRun(trajectory, &m);
  m.duration = duration;
  m.t_end = trajectory.t_end();
  m.final_q = ToMsg(VectorRef(trajectory.FinalState().head(nq)));
  m.final_v = ToMsg(VectorRef(trajectory.FinalState().tail(d)));
  m.margins = ToMsg(trajectory.margins);
  m.field_evaluations = static_cast<std::uint64_t>(trajectory.statistics.field_evaluations);
  m.steps = static_cast<std::uint64_t>(trajectory.statistics.steps);
  m.rejected_steps = static_cast<std::uint64_t>(trajectory.statistics.rejected_steps);
  m.method = IntegrationMethodNames()[static_cast<std::size_t>(trajectory.method)];
  m.implicit_steps = static_cast<std::uint64_t>(trajectory.statistics.implicit_steps);
  for (const Transition& transition : trajectory.transitions) {
    m.transitions.push_back(ToMsg(description, transition));
  }
  const Samples samples = SampleTrajectory(trajectory, count);
  for (std::size_t k = 0; k < trajectory.arcs.size(); ++k) {
    const Arc& arc = trajectory.arcs[k];
    TrajectoryArc a;
    a.mode = arc.mode.Names(description.constraints);
    a.mode_word = ToWord(description.constraints, arc.mode);
    m.mode_words.push_back(a.mode_word);
    a.t_begin = arc.t_begin;
    a.t_end = arc.t_end;
    a.input = ToMsg(VectorRef(arc.u));
    a.first_sample = static_cast<std::uint32_t>(samples.first_of_arc[k]);
    a.num_samples =
        static_cast<std::uint32_t>(samples.first_of_arc[k + 1] - samples.first_of_arc[k]);
    m.arcs.push_back(a);
  }
  m.t = samples.t;
  m.q = ToMsg(MatrixRef(samples.x.leftCols(nq)));
  m.v = ToMsg(MatrixRef(samples.x.rightCols(d)));
  return m;
}

Names TangentialNames(const MechanicalSystem& system) {
  Names names;
  if (!system.HasFriction()) return names;
  for (int i = 0; i < system.num_constraints(); ++i) {
    for (int r = 0; r < system.friction()[i].dimension; ++r) {
      names.push_back(system.description().constraints[static_cast<std::size_t>(i)]);
    }
  }
  return names;
}

std::vector<double> Tangential(const SystemDescription& description, const Vector& force) {
  const auto before =
      static_cast<Eigen::Index>(description.constraints.size() + description.bilateral.size());
  if (force.size() <= before) return {};
  return ToMsg(VectorRef(force.tail(force.size() - before)));
}

void AddForces(const MechanicalSystem& system, const Trajectory& trajectory,
               ContactTrajectory* message) {
  if (!system.HasFriction()) return;
  message->tangential = TangentialNames(system);
  const RowLayout rows(system);
  const auto nq = static_cast<std::size_t>(system.num_positions());
  const auto d = static_cast<std::size_t>(system.dof());
  Vector x(system.state_size());
  for (RowMajorMatrix* matrix : {&message->force, &message->tangential_force}) {
    matrix->rows = static_cast<std::uint32_t>(message->t.size());
    matrix->cols =
        static_cast<std::uint32_t>(matrix == &message->force ? rows.normal() : rows.tangential());
  }
  for (std::size_t k = 0; k < trajectory.arcs.size(); ++k) {
    const TrajectoryArc& arc = message->arcs[k];
    ContactDynamics dynamics(system, trajectory.arcs[k].u);
    for (std::size_t i = arc.first_sample; i < arc.first_sample + arc.num_samples; ++i) {
      AskBudget();
      std::copy_n(message->q.data.begin() + static_cast<std::ptrdiff_t>(i * nq), nq, x.data());
      std::copy_n(message->v.data.begin() + static_cast<std::ptrdiff_t>(i * d), d, x.data() + nq);
      dynamics.Evaluate(x, trajectory.arcs[k].mode);
      const Vector& force = dynamics.force();
      for (const double normal : rows.Normal(force)) message->force.data.push_back(normal);
      for (const double tangential : rows.Tangential(force)) {
        message->tangential_force.data.push_back(tangential);
      }
    }
  }
}

void AddLimits(const MechanicalSystem& system, const Trajectory& trajectory,
               ContactTrajectory* message) {
  const auto* limits = dynamic_cast<const EffortLimits*>(&system);
  if (limits == nullptr) return;
  for (std::size_t k = 0; k < trajectory.arcs.size(); ++k) {
    for (const LimitPassing& passing : LimitPassings(system, trajectory.arcs[k])) {
      LimitInstant m;
      m.t = passing.t;
      m.effort = limits->limited_efforts()[static_cast<std::size_t>(passing.effort)];
      m.before = EffortPieceName(passing.before);
      m.after = EffortPieceName(passing.after);
      message->arcs[k].limits.push_back(m);
    }
  }
}

ModeSequence ToModeSequence(const ContactTrajectory& trajectory) {
  ModeSequence m;
  m.header = trajectory.header;
  m.model = trajectory.model;
  for (const TrajectoryArc& arc : trajectory.arcs) {
    m.modes.emplace_back();
    m.modes.back().active = arc.mode;
    m.modes.back().mode_word = arc.mode_word;
    m.modes.back().t_begin = arc.t_begin;
    m.modes.back().t_end = arc.t_end;
  }
  return m;
}

std::vector<ModeInterval> ToModeIntervals(const Names& constraints, const Trajectory& trajectory) {
  std::vector<ModeInterval> intervals;
  for (const Arc& arc : trajectory.arcs) {
    intervals.emplace_back();
    intervals.back().active = arc.mode.Names(constraints);
    intervals.back().mode_word = ToWord(constraints, arc.mode);
    intervals.back().t_begin = arc.t_begin;
    intervals.back().t_end = arc.t_end;
  }
  return intervals;
}

Names ToLabels(const Names& constraints, const std::vector<ContactMode>& modes) {
  Names labels;
  for (ContactMode mode : modes) labels.push_back(mode.ToString(constraints));
  return labels;
}

std::string ToWord(const Names& constraints, ContactMode mode) {
  return mode.Word(static_cast<int>(constraints.size()));
}

Names ToWords(const Names& constraints, const std::vector<ContactMode>& modes) {
  Names words;
  for (ContactMode mode : modes) words.push_back(ToWord(constraints, mode));
  return words;
}

ContactOrder ToMsg(const SystemDescription& description, const OrderOutcome& outcome) {
  const Names& constraints = description.constraints;
  ContactOrder m;
  for (int i : outcome.order) m.order.push_back(constraints[static_cast<std::size_t>(i)]);
  m.v_after = ToMsg(VectorRef(outcome.v_plus));
  m.mode_after = outcome.mode_after.Names(constraints);
  m.mode_word = ToWord(constraints, outcome.mode_after);
  m.impulse = ToMsg(VectorRef(outcome.impulse.head(constraints.size())));
  m.tangential_impulse = Tangential(description, outcome.impulse);
  m.outcome = static_cast<std::uint8_t>(outcome.status.outcome);
  m.message = outcome.status.message;
  return m;
}

DirectionComparison ToMsg(const Names& constraints, const QuotientReport& report,
                          Eigen::Index size) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  DirectionComparison m;
  m.slope = report.slope;
  m.resolution = report.resolution;
  m.prediction_error = report.prediction_error;
  for (const QuotientSample& sample : report.samples) {
    const bool ok = sample.status.ok();
    m.alphas.push_back(sample.alpha);
    m.errors.push_back(ok ? sample.error : kNaN);
    m.outcomes.push_back(static_cast<std::uint8_t>(sample.status.outcome));
    m.modes.emplace_back();
    m.modes.back().names = ToLabels(constraints, sample.modes);
    m.mode_words.emplace_back();
    m.mode_words.back().names = ToWords(constraints, sample.modes);
    m.quotients.cols = static_cast<std::uint32_t>(size);
    for (Eigen::Index j = 0; j < size; ++j) {
      m.quotients.data.push_back(ok ? sample.quotient(j) : kNaN);
    }
  }
  m.quotients.rows = static_cast<std::uint32_t>(report.samples.size());
  return m;
}

}  // namespace ros_interface
}  // namespace contact_flow
