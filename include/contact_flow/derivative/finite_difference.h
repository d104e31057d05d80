// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {

/// One re-simulated, perturbed run.
struct QuotientSample {
  double alpha = 0;    ///< size of the perturbation
  Status status;       ///< of the perturbed run; not kOk: no quotient
  Vector final_state;  ///< x(T) from x ⊞ α w [nq+d]
  Vector quotient;     ///< (x_α(T) − x_0(T)) / α, as a tangent [2d]
  /// max |quotient − prediction|; NaN where there is no quotient.
  double error = std::numeric_limits<double>::quiet_NaN();
  std::vector<ContactMode> modes;  ///< mode sequence of the perturbed run
};

/// One-sided difference quotients beside a predicted derivative: the public check of
/// any B-derivative.
struct QuotientReport {
  std::vector<QuotientSample> samples;  ///< in the order of the α given
  /// Least-squares slope of log error over log α, from the samples whose error stands clear of
  /// rounding (`resolution`/α) and above `prediction_error`, or of rounding alone where the latter
  /// leaves fewer than two; 1 when the prediction is right and the outcome is PC², NaN when fewer
  /// than two samples qualify (then the errors themselves are at the level of rounding).
  double slope = 0;
  /// Error of one final state that the integrator's tolerance leaves, absolute.
  double resolution = 0;
  /// Estimated error of the prediction that was given: a quotient within it is right.
  double prediction_error = 0;
};

/// Re-simulates from x + α w for every α > 0 and compares (φ(T, x+αw) − φ(T, x))/α with
/// `prediction` [2d], whose error is estimated as `prediction_error` (BDerivative::Error). Runs are
/// made at tolerance 1e-12 with events told apart wherever errors of their instants allow it.
QuotientReport CompareWithQuotients(const MechanicalSystem& system, const VectorRef& x,
                                    const VectorRef& u, double duration, const VectorRef& direction,
                                    const VectorRef& prediction, const std::vector<double>& alphas,
                                    const SimulateOptions& options = {},
                                    double prediction_error = 0);

/// Makes the system again with other values of some parameters.
using SystemFactory = std::function<std::unique_ptr<MechanicalSystem>(const ParameterValues&)>;

/// The same for directions (δq, δv, δu, δp) [2d+k]: runs from x + α (w_q, w_v) with inputs u + α δu
/// on every interval and parameters p + α δp, the system made by `factory` from the values of all
/// its parameters.
QuotientReport CompareWithQuotients(const MechanicalSystem& system, const SystemFactory& factory,
                                    const Variables& variables, const VectorRef& x,
                                    const InputSchedule& input, double duration,
                                    const VectorRef& direction, const VectorRef& prediction,
                                    const std::vector<double>& alphas,
                                    const SimulateOptions& options = {},
                                    double prediction_error = 0);

}  // namespace contact_flow
