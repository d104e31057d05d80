// SPDX-License-Identifier: BSD-3-Clause
#include "propagation_verdict.h"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace contact_flow {
namespace {

/// Largest residual of the flow law in a propagator that is handed out, where it takes an error of
/// the state of more than kLargestNoise to explain it.
constexpr double kLargestResidual = 1e-4;
constexpr double kLargestNoise = 1e-5;

std::string Span(const Arc& arc) {
  std::ostringstream text;
  text.precision(12);
  text << "from t = " << arc.t_begin << " s to " << arc.t_end << " s";
  return text.str();
}

}  // namespace

void RefuseUnresolved(double t) {
  std::ostringstream message;
  message << "the variational equation cannot be resolved at t = " << t << " s";
  throw std::domain_error(message.str());
}

void RefuseNoNumber(const ContactDynamics& dynamics, double t) {
  const MechanicalSystem& system = dynamics.system();
  const SystemDescription& names = system.description();
  const Matrix& jacobian = dynamics.acceleration_jacobian();
  std::vector<std::string> variables = names.velocities;
  for (const std::string& name : names.velocities) variables.push_back("the rate of " + name);
  if (dynamics.variables().inputs) {
    variables.insert(variables.end(), names.inputs.begin(), names.inputs.end());
  }
  for (int i : dynamics.variables().parameters) {
    variables.push_back(names.parameters[static_cast<std::size_t>(i)].name);
  }
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << t << " s the derivative of an acceleration is no number";
  for (Eigen::Index c = 0; c < jacobian.cols(); ++c) {
    for (Eigen::Index r = 0; r < jacobian.rows(); ++r) {
      if (std::isfinite(jacobian(r, c))) continue;
      const auto by = static_cast<std::size_t>(c);
      message << ": that of '" << names.velocities[static_cast<std::size_t>(r)] << "' by '"
              << variables[by] << "'";
      throw std::domain_error(message.str());
    }
  }
  throw std::domain_error(message.str());
}

void RefuseNoError(double t) {
  std::ostringstream message;
  message.precision(12);
  message << "the error of the tangents from t = " << t << " s on is no number";
  throw std::domain_error(message.str());
}

void RefuseOverflow(const Arc& arc) {
  throw std::domain_error("the tangents " + Span(arc) + " are beyond the numbers there are");
}

void JudgeFlowLaw(const Arc& arc, const FlowLaw& law) {
  if (law.total() <= kLargestResidual || law.noise() <= kLargestNoise) return;
  std::ostringstream message;
  message.precision(12);
  message << "the tangents " << Span(arc)
          << " do not carry the field along as they must (relative residual " << law.total()
          << " of Φ F = F, which would take errors of the state of " << law.noise()
          << "): a force acts where the steps of the run did not see it";
  throw std::domain_error(message.str());
}

}  // namespace contact_flow
