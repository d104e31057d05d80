// SPDX-License-Identifier: BSD-3-Clause
#include "poincare_answer.h"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/ComputePoincareMap.h"
#include "contact_flow/analysis/orbit_sizes.h"
#include "limits.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using PoincareCodes = ComputePoincareMap::Response;

static_assert(PoincareCodes::NO_RETURN == static_cast<int>(ReturnStatus::kNoReturn) &&
                  PoincareCodes::STOPPED == static_cast<int>(ReturnStatus::kStopped) &&
                  PoincareCodes::TANGENT == static_cast<int>(ReturnStatus::kTangent) &&
                  PoincareCodes::NO_DERIVATIVE == static_cast<int>(ReturnStatus::kNoDerivative),
              "the constants of the service are the statuses");

const std::vector<std::string> kSectionKinds = {"apex", "coordinate", "velocity", "touchdown",
                                                "clock"};
constexpr double kTangent = 1e-8;  // a unit tangent this far off the section is none of it

Matrix ResolveNeutral(const MechanicalSystem& system, const PoincareRequest& request) {
  const Matrix translation = ResolveTranslation(system, request.translation);
  const Matrix rows = ToMatrix("neutral", request.neutral);
  const int n = 2 * system.dof();
  if ((rows.rows() > 0 || rows.cols() > 0) && rows.cols() != n) {
    throw std::invalid_argument("neutral.cols: neutral has " + std::to_string(rows.cols()) +
                                " columns, expected " + std::to_string(n) +
                                ", in the order (δq, δv)");
  }
  Matrix neutral(n, translation.cols() + rows.rows());
  neutral.leftCols(translation.cols()) = translation;
  if (rows.rows() > 0) neutral.rightCols(rows.rows()) = rows.transpose();
  return neutral;
}

Section ResolvePlace(const MechanicalSystem& system, const std::string& field,
                     const ReturnSection& section) {
  const SystemDescription& names = system.description();
  const int kind =
      section.kind.empty() ? 0 : NameIndex(field + ".kind", "kind", section.kind, kSectionKinds);
  CheckFinite(field + ".value", {section.value});
  if (section.direction < -1 || section.direction > 1) {
    throw std::invalid_argument(field + ".direction is " + std::to_string(section.direction) +
                                ", expected -1, 0 or 1");
  }
  switch (kind) {
    case 0:
      return {Section::Kind::kVelocity,
              NameIndex(field + ".name", "velocity", section.name, names.velocities), 0, -1};
    case 1:
      return {Section::Kind::kCoordinate,
              NameIndex(field + ".name", "coordinate", section.name, names.coordinates),
              section.value, section.direction};
    case 2:
      return {Section::Kind::kVelocity,
              NameIndex(field + ".name", "velocity", section.name, names.velocities), section.value,
              section.direction};
    case 3:
      return {Section::Kind::kEvent,
              NameIndex(field + ".name", "constraint", section.name, names.constraints), 0, -1};
    default:
      if (!(section.value > 0) || section.value > kMaxDuration) {
        throw std::invalid_argument(field + ".value is " + std::to_string(section.value) +
                                    ", expected a period in seconds");
      }
      return Section::After(section.value);
  }
}

ReturnSymmetry ResolveSymmetry(const MechanicalSystem& system, const std::string& field,
                               const ReturnSection& section) {
  if (section.exchange.size() % 2 != 0) {
    throw std::invalid_argument(field + ".exchange has " + std::to_string(section.exchange.size()) +
                                " entries, expected pairs of coordinates");
  }
  if (section.shifted.size() != section.shift.size()) {
    throw std::invalid_argument(field + ".shift has " + std::to_string(section.shift.size()) +
                                " entries, expected one for each of the " +
                                std::to_string(section.shifted.size()) + " in shifted");
  }
  CheckFinite(field + ".shift", section.shift);
  const std::vector<std::string>& names = system.description().coordinates;
  const auto check = [&](const char* list, const std::vector<std::string>& given) {
    for (std::size_t k = 0; k < given.size(); ++k) {
      NameIndex(field + list + "[" + std::to_string(k) + "]", "coordinate", given[k], names);
    }
  };
  check(".exchange", section.exchange);
  check(".shifted", section.shifted);
  check(".travel", section.travel);
  ReturnSymmetry symmetry;
  for (std::size_t k = 0; k < section.exchange.size(); k += 2) {
    symmetry.Exchange(system, section.exchange[k], section.exchange[k + 1]);
  }
  for (std::size_t k = 0; k < section.shifted.size(); ++k) {
    symmetry.Shift(system, section.shifted[k], section.shift[k]);
  }
  symmetry.Travel(system, section.travel);
  return symmetry;
}

}  // namespace

Section ResolveSection(const MechanicalSystem& system, const std::string& field,
                       const ReturnSection& section) {
  Section resolved = ResolvePlace(system, field, section);
  resolved.symmetry = ResolveSymmetry(system, field, section);
  return resolved;
}

Matrix ResolveTranslation(const MechanicalSystem& system, const std::vector<std::string>& names) {
  const int d = system.dof();
  if (names.empty()) return Matrix(2 * d, 0);
  Matrix columns = Matrix::Zero(2 * d, 2);
  for (std::size_t k = 0; k < names.size(); ++k) {
    const int i = NameIndex("translation[" + std::to_string(k) + "]", "coordinate", names[k],
                            system.description().velocities);
    columns(i, 0) = columns(d + i, 1) = 1;
  }
  return columns;
}

AssessedReturn Reduce(const MechanicalSystem& system, const VectorRef& x, PoincareReturn one,
                      const Matrix& neutral) {
  AssessedReturn assessed;
  assessed.one = std::move(one);
  const PoincareReturn& r = assessed.one;
  if (!r.returned()) return assessed;
  assessed.distance = system.Separation(r.x, x).cwiseAbs().maxCoeff();
  assessed.off_orbit = OffOrbit(system, x, r, neutral);
  if (r.status != ReturnStatus::kReturned) return assessed;
  assessed.reducible = r.reduced.rows() == r.reduced.cols() && r.reduced.rows() > 0;
  if (!assessed.reducible) {
    assessed.warnings.push_back(MakeWarning(
        ResultWarning::NOT_REDUCIBLE,
        "directions along the section in the contact mode are not as many at the return as at the "
        "start: DP is no map of one space into itself",
        r.time));
    return assessed;
  }
  const Matrix seen = r.start_basis.transpose() * neutral;
  for (Eigen::Index k = 0; k < neutral.cols(); ++k) {
    const double off = (neutral.col(k) - r.start_basis * seen.col(k)).norm();
    if (!(off <= kTangent * neutral.col(k).norm())) {
      throw std::invalid_argument("neutral direction number " + std::to_string(k) +
                                  " is no tangent of the section that the contact mode admits");
    }
  }
  if (neutral.cols() > 0) {
    assessed.reduced = SetAside(r.reduced, seen);
    assessed.reduced.basis = (r.start_basis * assessed.reduced.basis).eval();
  } else {
    assessed.reduced = {r.reduced, r.start_basis, 0};
  }
  if (assessed.reduced.residual > kNeutral) {
    std::ostringstream note;
    note << "the neutral directions are none: residual " << assessed.reduced.residual;
    assessed.warnings.push_back(MakeWarning(ResultWarning::NOT_NEUTRAL, note.str()));
  }
  return assessed;
}

ReturnQuestion ResolveReturn(const Setup& setup, const PoincareRequest& request) {
  const MechanicalSystem& system = *setup.system;
  const ResolvedRun run = ResolveRun(setup, 0, request.state, request.input, {}, {});
  ReturnQuestion question;
  question.x = run.x;
  question.u = run.input.values.front();
  PoincareOptions& options = question.options;
  options.simulate = ResolveOptions(TightOptions(setup), request.options);
  options.derivative = ResolveOptions(TightDerivativeOptions(setup), request.derivative_options);
  options.horizon = ResolveNumber("horizon", request.horizon, options.horizon, kMaxHorizon);
  CheckWithin("horizon", options.horizon, kMinHorizon, kMaxHorizon);
  options.shortest = ResolveNumber("shortest", request.shortest, options.shortest, kMaxHorizon);
  question.section = ResolveSection(system, "section", request.section);
  question.neutral = ResolveNeutral(system, request);
  return question;
}

AssessedReturn AssessReturn(const Setup& setup, const PoincareRequest& request) {
  const MechanicalSystem& system = *setup.system;
  const ReturnQuestion asked = ResolveReturn(setup, request);
  const PoincareMap map(system, asked.u, asked.section, asked.options);
  PoincareReturn one = map.Return(asked.x);
  if (one.status == ReturnStatus::kRefused) throw std::invalid_argument(one.message);
  AssessedReturn assessed = Reduce(system, asked.x, std::move(one), asked.neutral);
  if (!assessed.reducible || assessed.off_orbit > kOnOrbit) return assessed;
  const std::string differs = NextReturnDiffers(system, map, asked.x, assessed.one, asked.neutral);
  if (!differs.empty()) {
    assessed.warnings.push_back(MakeWarning(
        ResultWarning::NOT_NEUTRAL, "the neutral directions are none of the motion: " + differs));
  }
  return assessed;
}

PoincareResult ToMsg(const MechanicalSystem& system, const AssessedReturn& assessed) {
  const SystemDescription& names = system.description();
  const PoincareReturn& one = assessed.one;
  PoincareResult result;
  result.model = names.name;
  result.coordinates = names.coordinates;
  result.velocities = names.velocities;
  result.constraints = names.constraints;
  result.outcome = static_cast<std::uint8_t>(one.status);
  if (one.status == ReturnStatus::kRefused) result.outcome = PoincareCodes::REFUSED;
  result.message = one.message;
  WarnOfRun(one.trajectory, &result);
  for (const ResultWarning& warning : assessed.warnings) Warn(warning, &result);
  result.time = one.time;
  if (!one.trajectory.arcs.empty()) {
    result.modes = ToModeIntervals(names.constraints, one.trajectory);
  }
  if (!one.returned()) return result;
  result.q = ToMsg(VectorRef(one.x.head(system.num_positions())));
  result.v = ToMsg(VectorRef(one.x.tail(system.dof())));
  result.distance = assessed.distance;
  result.crossing_speed = one.crossing_speed;
  if (one.status != ReturnStatus::kReturned) return result;
  result.map = ToMsg(one.map);
  Matrix times(static_cast<Eigen::Index>(one.return_time.pieces().size()), one.return_time.cols());
  for (Eigen::Index k = 0; k < times.rows(); ++k) {
    times.row(k) = one.return_time.pieces()[static_cast<std::size_t>(k)].matrix;
  }
  result.return_time = ToMsg(MatrixRef(times));
  if (!assessed.reducible) return result;
  result.reduced = ToMsg(assessed.reduced.map);
  result.basis = ToMsg(MatrixRef(assessed.reduced.basis));
  result.neutral_residual = assessed.reduced.residual;
  return result;
}

PoincareResult Answer(const Setup& setup, const PoincareRequest& request) {
  CheckMessage(request);
  PoincareResult result = ToMsg(*setup.system, AssessReturn(setup, request));
  if (setup.options.cancelled && setup.options.cancelled()) result.outcome = kAnalysisCancelled;
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
