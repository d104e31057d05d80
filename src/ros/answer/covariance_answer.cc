// SPDX-License-Identifier: BSD-3-Clause
#include "covariance_answer.h"

#include <stdexcept>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/piecewise_linear/covariance.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/request.h"
#include "src/session/directions.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr int kMaxRotations = 1000000, kMaxSeed = 2000000000;
constexpr double kAdmissible = 1e-9;  // of a column of the covariance, relative

Matrix ResolveCovariance(const CovarianceRequest& request, int n) {
  if (request.deviations.empty() == request.covariance.data.empty()) {
    throw std::invalid_argument("either covariance or deviations must be given");
  }
  if (request.deviations.empty()) {
    const Matrix P = ToMatrix("covariance", request.covariance);
    if (P.rows() != n || P.cols() != n) {
      throw std::invalid_argument("covariance is " + std::to_string(P.rows()) + " × " +
                                  std::to_string(P.cols()) + ", expected " + std::to_string(n) +
                                  " × " + std::to_string(n) + ", in the order (δq, δv, δu, δp)");
    }
    return P;
  }
  if (request.deviations.size() != static_cast<std::size_t>(n)) {
    throw std::invalid_argument("deviations has " + std::to_string(request.deviations.size()) +
                                " entries, expected " + std::to_string(n) +
                                ", in the order (δq, δv, δu, δp)");
  }
  CheckFinite("deviations", request.deviations);
  Matrix P = Matrix::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    const double deviation = request.deviations[static_cast<std::size_t>(i)];
    if (deviation < 0) {
      throw std::invalid_argument("deviations[" + std::to_string(i) + "] is " +
                                  std::to_string(deviation) + ", expected ≥ 0");
    }
    P(i, i) = deviation * deviation;
  }
  return P;
}

/// Throws unless all that varies keeps the constraints that are active at the start.
void CheckAdmissible(const Setup& setup, const ResolvedRun& run, const Matrix& P,
                     const Variables& variables) {
  const ContactMode mode = InitialMode(*setup.system, run.x, run.input.values.front(), run.options);
  for (Eigen::Index k = 0; k < P.cols(); ++k) {
    const Vector w = P.col(k);
    const Vector kept = ProjectAdmissible(*setup.system, run.x, mode, w, variables);
    if ((kept - w).cwiseAbs().maxCoeff() <= kAdmissible * w.cwiseAbs().maxCoeff()) continue;
    throw std::invalid_argument("the covariance leaves the contact mode " +
                                mode.ToString(setup.system->description().constraints) +
                                " of the initial state: column " + std::to_string(k) +
                                " is no tangent that it admits");
  }
}

/// Throws unless both w and −w are admitted for all that varies.
void CheckInside(const SystemDescription& names, const StartCone& start, const Matrix& P) {
  for (Eigen::Index k = 0; k < P.cols(); ++k) {
    for (const double sign : {1.0, -1.0}) {
      const int i = start.Leaves(sign * P.col(k));
      if (i < 0) continue;
      const std::string name = "'" + names.constraints[static_cast<std::size_t>(i)] + "'";
      throw std::invalid_argument(
          start.Reverses(i) ? "the covariance moves the contact " + name +
                                  ", which begins to slip at the start, against that slip: how "
                                  "it is reversed is not followed"
                            : "the covariance leads through the constraint " + name +
                                  ", which the initial state touches");
    }
  }
}

}  // namespace

CovarianceResult Answer(const Setup& setup, const CovarianceRequest& request) {
  CheckMessage(request);
  const MechanicalSystem& system = *setup.system;
  const SystemDescription& names = system.description();
  const ResolvedRun run = ResolveRun(setup, request);
  BDerivativeOptions options = ResolveOptions(setup.derivative_options, request.derivative_options);
  options.variables = ResolveVariables(setup, request.by_inputs, request.by_parameters);
  CovarianceOptions cubature;
  cubature.rotations =
      ResolveCount("rotations", request.rotations, cubature.rotations, kMaxRotations);
  cubature.seed = static_cast<unsigned>(ResolveCount("seed", request.seed, 1, kMaxSeed));
  const Matrix P = ResolveCovariance(request, 2 * system.dof() + options.variables.Size(system));
  CheckAdmissible(setup, run, P, options.variables);

  CovarianceResult result;
  result.model = names.name;
  result.coordinates = names.coordinates;
  result.velocities = names.velocities;
  result.variables = VariableNames(names, options.variables);
  const Trajectory trajectory = Simulate(system, run.x, run.input, run.duration, run.options);
  const BDerivative B = DifferentiateOutcome(system, trajectory, options);
  result.outcome = static_cast<std::uint8_t>(B.status.outcome);
  result.message = B.status.message;
  WarnOfRun(trajectory, &result);
  result.final_q = ToMsg(VectorRef(trajectory.FinalState().head(system.num_positions())));
  result.final_v = ToMsg(VectorRef(trajectory.FinalState().tail(system.dof())));
  if (!B.status.ok()) return result;
  CheckInside(names, B.start, P);
  try {
    const PiecewiseLinearMap map = B.Pieces();
    const OutcomeCovariance moments = PropagateCovariance(map, P, cubature);
    result.method = CovarianceMethodName(moments.method);
    result.pieces = static_cast<std::uint32_t>(map.pieces().size());
    result.mean = ToMsg(VectorRef(moments.mean));
    result.covariance = ToMsg(MatrixRef(moments.covariance));
    result.mean_error = moments.mean_error;
    result.covariance_error = moments.covariance_error;
    result.points = static_cast<std::uint32_t>(moments.points);
  } catch (const std::length_error& limit) {
    result.outcome = static_cast<std::uint8_t>(Outcome::kTooManyPieces);
    result.message = limit.what();
  } catch (const NotPiecewiseLinear& reason) {
    result.outcome = static_cast<std::uint8_t>(Outcome::kNotDifferentiable);
    result.message = reason.what();
  }
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
