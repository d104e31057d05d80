// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bindings.h"
#include "contact_flow/analysis/poincare.h"
#include "contact_flow/piecewise_linear/section.h"
#include "pickles.h"

namespace contact_flow {
namespace python {

/// A return map with its system.
struct Poincare {
  std::shared_ptr<const System> system;
  Vector u;
  Section section;
  py::object spec;  // as it was given
  PoincareOptions options;
  double max_seconds;  // of each answer, by the clock
  Question question;
};

/// One return with its system.
struct Return {
  std::shared_ptr<const System> system;
  std::shared_ptr<const PoincareReturn> value;
  Vector start;             // x
  SimulateOptions options;  // of its run
  bool at_event = false;    // the section is one: the run ends behind it
  Question question = {};
  std::shared_ptr<const Poincare> map = {};  // whose first return it is; none of an orbit's closing
};

/// The stability of the orbit through the start of a return, but for translations along the
/// coordinates of these names. Throws ValueError where there is no orbit, or no such symmetry.
py::object StabilityOf(const Return& r, const std::vector<std::string>& translation,
                       const py::kwargs& options);

/// The tangents of a common shift of the coordinates of these names, and of its rate [2d×2], or
/// none [2d×0]. Throws ValueError where P(x) is not x but for such a shift, and where the next
/// return is another.
Matrix OrbitShift(const Return& r, const std::vector<std::string>& translation);
/// Throws ValueError where what was set aside is no symmetry.
void RequireSymmetry(const ReducedMap& rest);

/// From an object with kind, name, value and sign; throws ValueError with the nearest name.
Section ToSection(const System& system, const py::handle& spec);

}  // namespace python
}  // namespace contact_flow
