// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>
#include <string>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/measured_errors.h"
#include "contact_flow/derivative/start_directions.h"
#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

/// The Python module: values of the core with what keeps them alive. Every function that may take
/// long, or that locks, lets go of the interpreter's lock first (see unlocked.h).
namespace contact_flow {
namespace python {

namespace py = pybind11;

/// A MechanicalSystem with what it was made from.
class System : public std::enable_shared_from_this<System> {
 public:
  virtual ~System() = default;
  /// The same with values of all parameters.
  virtual std::unique_ptr<MechanicalSystem> Make(const ParameterValues& values) const = 0;
  /// The same as a System; values that are not given are those of this one.
  virtual std::shared_ptr<System> With(const ParameterValues& values) const = 0;
  /// "cf.Model('soft_biped')", without the parameters.
  virtual std::string Origin() const = 0;

  const MechanicalSystem& get() const { return *system; }
  const SystemDescription& description() const { return system->description(); }
  /// The values in force, with these in their place.
  ParameterValues Values(const ParameterValues& changes = {}) const;

  std::shared_ptr<const MechanicalSystem> system;
};

/// A run with the request that repeats it.
struct Run {
  std::shared_ptr<const System> system;
  Vector x0;
  InputSchedule inputs;
  double duration = 0;
  SimulateOptions options;
  Trajectory trajectory;
  bool repeats = true;  // false: it ends behind its event, where no request ends

  /// Throws ValueError where no request repeats the run.
  void CheckRepeats(const std::string& what) const {
    if (repeats) return;
    throw py::value_error(what +
                          ": the run ends behind its event, and no request repeats it; the "
                          "PoincareReturn has its derivative");
  }
  const SystemDescription& description() const { return system->description(); }
};

/// A derivative with its run. Event maps have caches: one thread at a time.
struct Derivative {
  std::shared_ptr<const Run> run;
  BDerivative map;
  StartDirections directions;  // that the start of the run admits
  mutable std::mutex mutex;
  mutable std::unique_ptr<const ValidityEstimator> estimator;  // made when it is first asked
  mutable std::shared_ptr<const MeasuredErrors> errors;        // likewise, unless it was cut short

  const MechanicalSystem& system() const { return run->system->get(); }
};

/// A radius with the name of the constraint whose event sets it.
struct NamedRadius {
  ValidityRadius value;
  std::string constraint;  // empty: a whole event
};

/// B(w) was asked for where there is no derivative.
struct NoDerivative : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

void BindStatus(py::module_* module);
void BindSystem(py::module_* module);
void BindTerms(py::module_* module);
void BindModels(py::module_* module);
void BindPythonModel(py::module_* module);
void BindLinearInputs(py::module_* module);
void BindRun(py::module_* module);
void BindEvents(py::module_* module);
void BindSimulate(py::module_* module);
void BindPieces(py::module_* module);
void BindDerivative(py::module_* module);
void BindDerivativeParts(py::module_* module);
void BindGradient(py::module_* module);
void BindAssumptions(py::module_* module);
void BindMapAnalyses(py::module_* module);
void BindPoincare(py::module_* module);
void BindFeedback(py::module_* module);
void BindOrbit(py::module_* module);
void BindOptimize(py::module_* module);
void BindOnline(py::module_* module);
void BindBatch(py::module_* module);
void BindSweep(py::module_* module);
void BindTrajectory(py::module_* module);
void BindPolicy(py::module_* module);

}  // namespace python
}  // namespace contact_flow
