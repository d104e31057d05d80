// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/finite_difference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr double kTolerance = 1e-12;
constexpr double kSlowPart = 1e-3;  // speeds are told from rest down to this part of α [m/s]
constexpr double kClear = 20;       // an error this far above the resolution counts for the slope

/// Least-squares slope of log(error) over log(α).
double Slope(const std::vector<QuotientSample>& samples, double resolution,
             double prediction_error) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const QuotientSample& sample : samples) {
    const double noise = std::max(kClear * resolution / sample.alpha, prediction_error);
    if (!sample.status.ok() || !(sample.error > noise)) continue;
    const double x = std::log(sample.alpha), y = std::log(sample.error);
    n += 1;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  const double spread = n * sxx - sx * sx;
  if (n < 2 || spread <= 0) return std::numeric_limits<double>::quiet_NaN();
  return (n * sxy - sx * sy) / spread;
}

/// The system and input that (δu, δp) lead to; no system when it stays the same.
struct Perturbed {
  std::unique_ptr<MechanicalSystem> system;
  InputSchedule input;
};

Perturbed Perturb(const MechanicalSystem& system, const SystemFactory& factory,
                  const Variables& variables, const InputSchedule& input, const Vector& change) {
  Perturbed perturbed;
  perturbed.input = input;
  int k = 0;
  if (variables.inputs) {
    k = static_cast<int>(input.values.front().size());
    for (Vector& u : perturbed.input.values) u += change.head(k);
  }
  if (change.tail(change.size() - k).isZero(0)) return perturbed;
  ParameterValues values;
  for (const Parameter& parameter : system.description().parameters) {
    values[parameter.name] = parameter.value;
  }
  for (int index : variables.parameters) {
    values[system.description().parameters[index].name] += change(k++);
  }
  perturbed.system = factory(values);
  return perturbed;
}

}  // namespace

QuotientReport CompareWithQuotients(const MechanicalSystem& system, const VectorRef& x,
                                    const VectorRef& u, double duration, const VectorRef& direction,
                                    const VectorRef& prediction, const std::vector<double>& alphas,
                                    const SimulateOptions& options, double prediction_error) {
  return CompareWithQuotients(system, SystemFactory(), Variables(), x, InputSchedule::Constant(u),
                              duration, direction, prediction, alphas, options, prediction_error);
}

QuotientReport CompareWithQuotients(const MechanicalSystem& system, const SystemFactory& factory,
                                    const Variables& variables, const VectorRef& x,
                                    const InputSchedule& input, double duration,
                                    const VectorRef& direction, const VectorRef& prediction,
                                    const std::vector<double>& alphas,
                                    const SimulateOptions& options, double prediction_error) {
  const int n = 2 * system.dof(), size = n + variables.Size(system);
  if (direction.size() != size || prediction.size() != n) {
    throw std::invalid_argument("direction and prediction need " + std::to_string(size) + " and " +
                                std::to_string(n) + " entries");
  }
  const Vector by_variables = direction.tail(size - n);
  SimulateOptions exact = options;
  exact.relative_tolerance = kTolerance;
  exact.absolute_tolerance = std::min(options.absolute_tolerance, kTolerance);
  exact.simultaneity_tolerance = 0;  // events of perturbed runs are told apart wherever they can be
  exact.dense = false;
  const BudgetStage stage("the perturbed runs");
  QuotientReport report;
  const Trajectory base = Simulate(system, x, input, duration, exact);
  AskBudget();
  if (!base.status.ok()) {
    throw std::domain_error("the unperturbed run ends with: " + base.status.message);
  }
  // What the tolerance leaves in a final state: the change when it is three times looser.
  SimulateOptions looser = exact;
  looser.relative_tolerance = 3 * kTolerance;
  looser.absolute_tolerance = 3 * exact.absolute_tolerance;
  const Trajectory loose = Simulate(system, x, input, duration, looser);
  report.resolution =
      system.Separation(loose.FinalState(), base.FinalState()).cwiseAbs().maxCoeff() +
      1e-15 * base.FinalState().cwiseAbs().maxCoeff();
  AskBudget();
  for (double alpha : alphas) {
    if (!(alpha > 0) || !std::isfinite(alpha)) {
      throw std::invalid_argument("alpha is " + std::to_string(alpha) +
                                  ": it must be finite and positive");
    }
    QuotientSample sample;
    sample.alpha = alpha;
    try {
      exact.speed_tolerance = std::min(options.speed_tolerance, kSlowPart * alpha);
      const Perturbed perturbed = Perturb(system, factory, variables, input, alpha * by_variables);
      const Trajectory run =
          Simulate(perturbed.system ? *perturbed.system : system,
                   system.Perturb(x, alpha * direction.head(n)), perturbed.input, duration, exact);
      sample.status = run.status;
      sample.final_state = run.FinalState();
      sample.modes = run.ModeSequence();
      if (run.status.ok()) {
        sample.quotient = system.Separation(sample.final_state, base.FinalState()) / alpha;
        sample.error = (sample.quotient - prediction).cwiseAbs().maxCoeff();
      }
    } catch (const std::invalid_argument& refusal) {
      sample.status = {Outcome::kNotDifferentiable, refusal.what()};
    }
    AskBudget();
    report.samples.push_back(sample);
  }
  report.prediction_error = prediction_error;
  report.slope = Slope(report.samples, report.resolution, prediction_error);
  // An estimate that is above all errors says nothing against their slope.
  if (std::isnan(report.slope)) report.slope = Slope(report.samples, report.resolution, 0);
  return report;
}

}  // namespace contact_flow
