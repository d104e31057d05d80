// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "bindings.h"
#include "contact_flow/contact_mode.h"
#include "contact_flow/types.h"

namespace contact_flow {
namespace python {

/// Real numbers as a contiguous array of double; no copy where they are one. Throws TypeError,
/// naming `field`, for what is no array of real numbers.
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
Array ToArray(const py::handle& value, const char* field);
/// A vector of `size` numbers (any where size < 0). Throws ValueError with field, length and
/// `names`, of what the numbers are.
Vector ToVector(const py::handle& value, const char* field, Eigen::Index size,
                const std::vector<std::string>* names = nullptr);
/// A matrix of `cols` columns (any where cols < 0).
Matrix ToMatrix(const py::handle& value, const char* field, Eigen::Index cols = -1);
/// A vector, or numbers by name over `base`. Throws ValueError with the nearest name.
Vector ToNamedVector(const py::handle& value, const char* field, const Vector& base,
                     const std::vector<std::string>& names);

/// A number, or a count ≥ `least`. Throws TypeError and ValueError, naming `field`, for what is
/// neither of them.
double ToNumber(const py::handle& value, const char* field);
int ToCount(const py::handle& value, const char* field, int least = 1);
/// A duration [s] ≥ 0; None: the nominal one.
double ToDuration(const System& system, const py::handle& duration);
/// Throws ValueError unless `seconds` > 0, infinite where there is no limit.
void CheckMaxSeconds(double seconds, const char* name = "max_seconds");

/// The state (q, v) of the argument: None: the nominal one; names: over the nominal one.
Vector ToState(const System& system, const py::handle& x);
/// A constant input: None: the nominal one; names: over the nominal one.
Vector ToInput(const System& system, const py::handle& u);
/// Inputs of a run: the same, or an object with t [K] and u [K×m], as contact_flow.Grid.
InputSchedule ToSchedule(const System& system, const py::handle& inputs);
/// Names of x: coordinates, then "d/dt velocity".
std::vector<std::string> StateNames(const SystemDescription& description);
/// Names of tangents: velocities, "d/dt velocity", inputs, parameters that are differentiated by;
/// "input knee" and "parameter knee" where something before them is called so, too.
std::vector<std::string> TangentNames(const SystemDescription& description,
                                      const Variables& variables);

/// ("left_foot", "right_foot")
py::tuple ToNames(ConstraintSet contacts, const SystemDescription& description);
/// Of each mode.
py::list ToNames(const std::vector<ContactMode>& modes, const SystemDescription& description);
/// A set of constraints from names; throws ValueError with the nearest.
ConstraintSet ToContacts(const py::handle& names, const SystemDescription& description);
/// Index of a name; throws ValueError, "unknown `kind` …" with the nearest.
int IndexOf(const std::string& kind, const std::string& name,
            const std::vector<std::string>& names);

/// By keyword, names as in C++. Throws TypeError for an unknown one, with the nearest, and
/// ValueError for a value out of its range.
SimulateOptions ToOptions(const py::kwargs& keywords, SimulateOptions base = {});
BDerivativeOptions ToOptions(const py::kwargs& keywords, BDerivativeOptions base);
/// Takes the keywords of a class of options away from those of another.
py::kwargs Take(const std::vector<std::string>& names, py::kwargs* keywords);
const std::vector<std::string>& SimulateOptionNames();
const std::vector<std::string>& DerivativeOptionNames();
py::dict ToDict(const SimulateOptions& options);
py::dict ToDict(const BDerivativeOptions& options);
/// ["state", "inputs", "stiffness"]; "parameters": all.
Variables ToVariables(const py::handle& by, const SystemDescription& description);

/// Parameters from keywords.
ParameterValues ToParameters(const py::handle& mapping);

/// 0.5, 1e-09: as Python prints it.
std::string Number(double value);
/// Names, joined by ", ".
std::string Join(const std::vector<std::string>& names);

/// Vectors of a value that lives in `owner`, without a copy and read-only.
py::array View(const Vector& vector, const py::handle& owner);
py::array View(const Matrix& matrix, const py::handle& owner);

}  // namespace python
}  // namespace contact_flow
