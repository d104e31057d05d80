// SPDX-License-Identifier: BSD-3-Clause
// The extension module contact_flow._core, part by part.
#include <pybind11/pybind11.h>

#include "bindings.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "receding.h"
#include "unlocked.h"

PYBIND11_MODULE(_core, module) {
  using namespace contact_flow::python;  // NOLINT(build/namespaces)
  module.doc() = "contact_flow in C++; use it through the package contact_flow.";
  module.attr("__version__") = CONTACT_FLOW_VERSION;
  module.def("have_linear_programs", &contact_flow::HaveLinearPrograms,
             "Whether the linear-programming library (Clp) is compiled in.");
  BindStatus(&module);
  BindSystem(&module);
  BindTerms(&module);
  BindModels(&module);
  BindPythonModel(&module);
  BindLinearInputs(&module);
  BindRun(&module);
  BindEvents(&module);
  BindSimulate(&module);
  BindPieces(&module);
  BindDerivative(&module);
  BindDerivativeParts(&module);
  BindGradient(&module);
  BindAssumptions(&module);
  BindMapAnalyses(&module);
  BindPoincare(&module);
  BindFeedback(&module);
  BindOrbit(&module);
  BindOptimize(&module);
  BindOnline(&module);
  BindReceding(&module);
  BindBatch(&module);
  BindSweep(&module);
  BindTrajectory(&module);
  BindPolicy(&module);
  pybind11::module_::import("atexit").attr("register")(
      pybind11::cpp_function(&contact_flow::python::Unlocking::End));
}
