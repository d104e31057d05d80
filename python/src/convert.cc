// SPDX-License-Identifier: BSD-3-Clause
#include "convert.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace python {
namespace {

using Names = std::vector<std::string>;

std::string Shape(const py::array& array) {
  std::string text;
  for (py::ssize_t k = 0; k < array.ndim(); ++k) {
    text += (k > 0 ? "×" : "") + std::to_string(array.shape(k));
  }
  return text.empty() ? "one number" : text;
}

/// A dict, or what is as one: numbers by name. Arrays have no keys.
bool IsMapping(const py::handle& value) {
  return py::isinstance<py::dict>(value) ||
         (!py::isinstance<py::array>(value) && py::hasattr(value, "keys"));
}

/// An array of numpy's own class, none of those derived from it.
bool IsPlainArray(const py::handle& value) {
  static const PyObject* const plain = py::module_::import("numpy").attr("ndarray").ptr();
  return reinterpret_cast<const PyObject*>(Py_TYPE(value.ptr())) == plain;
}

/// Of these there is nothing to convert, which takes longer than all else.
bool HasDoublesInRows(const py::handle& array) {
  static const PyObject* const doubles = py::dtype::of<double>().release().ptr();
  const auto* fields = py::detail::array_proxy(array.ptr());
  constexpr int kNeeded =
      py::detail::npy_api::NPY_ARRAY_C_CONTIGUOUS_ | py::detail::npy_api::NPY_ARRAY_ALIGNED_;
  return fields->descr == doubles && (fields->flags & kNeeded) == kNeeded;
}

/// Hidden numbers of a masked array are no numbers.
void RefuseMasked(const py::handle& value, const char* field) {
  if (!py::isinstance<py::array>(value) || !py::hasattr(value, "mask")) return;
  if (py::module_::import("numpy").attr("ma").attr("is_masked")(value).cast<bool>()) {
    throw py::value_error(std::string(field) + " is a masked array, with numbers left out");
  }
}

}  // namespace

Array ToArray(const py::handle& value, const char* field) {
  if (IsPlainArray(value)) {
    if (HasDoublesInRows(value)) return py::reinterpret_borrow<Array>(value);
  } else {
    RefuseMasked(value, field);
  }
  const py::array any = py::array::ensure(value);
  if (!any) {
    PyErr_Clear();
    throw py::type_error(std::string(field) + " is no array of numbers");
  }
  const char kind = any.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b') {
    if (any.size() == 0) {
      return Array(std::vector<py::ssize_t>(any.shape(), any.shape() + any.ndim()));
    }
    throw py::type_error(std::string(field) + " is an array of dtype '" +
                         py::str(any.dtype()).cast<std::string>() + "', expected real numbers");
  }
  return Array::ensure(any);
}

Vector ToVector(const py::handle& value, const char* field, Eigen::Index size, const Names* names) {
  const Array array = ToArray(value, field);
  if (array.ndim() != 1 || (size >= 0 && array.size() != size)) {
    const std::string expected = size < 0 ? "a vector" : std::to_string(size) + " numbers";
    throw py::value_error(std::string(field) + " has shape " + Shape(array) + ", expected " +
                          expected + (names ? ": " + Join(*names) : ""));
  }
  return Eigen::Map<const Vector>(array.data(), array.size());
}

Matrix ToMatrix(const py::handle& value, const char* field, Eigen::Index cols) {
  const Array array = ToArray(value, field);
  if (array.ndim() != 2 || (cols >= 0 && array.shape(1) != cols)) {
    throw py::value_error(std::string(field) + " has shape " + Shape(array) +
                          ", expected a matrix" +
                          (cols >= 0 ? " of " + std::to_string(cols) + " columns" : ""));
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(array.data(), array.shape(0), array.shape(1));
}

Vector ToNamedVector(const py::handle& value, const char* field, const Vector& base,
                     const Names& names) {
  if (!IsMapping(value)) return ToVector(value, field, base.size(), &names);
  Vector vector = base;
  for (const auto& entry : py::dict(py::reinterpret_borrow<py::object>(value))) {
    const std::string name = py::str(entry.first);
    try {
      vector(IndexOf("name", name, names)) = entry.second.cast<double>();
    } catch (const std::invalid_argument& unknown) {
      throw py::value_error(std::string(field) + ": " + unknown.what());
    } catch (const py::cast_error&) {
      throw py::type_error(std::string(field) + "['" + name + "'] is no number");
    }
  }
  return vector;
}

double ToNumber(const py::handle& value, const char* field) {
  try {
    return value.cast<double>();
  } catch (const py::cast_error&) {
    throw py::type_error(std::string(field) + " is " + py::repr(value).cast<std::string>() +
                         ", expected a number");
  }
}

int ToCount(const py::handle& value, const char* field, int least) {
  const double count = ToNumber(value, field);
  if (!(count >= least) || count > std::numeric_limits<int>::max() || count != std::floor(count)) {
    throw py::value_error(std::string(field) + " is " + py::str(value).cast<std::string>() +
                          ", expected a whole number ≥ " + std::to_string(least));
  }
  return static_cast<int>(count);
}

double ToDuration(const System& system, const py::handle& duration) {
  if (duration.is_none()) return system.get().nominal().duration;
  const double seconds = ToNumber(duration, "duration");
  if (!(seconds >= 0) || !std::isfinite(seconds)) {
    throw py::value_error("duration is " + Number(seconds) + " s, expected a number ≥ 0");
  }
  return seconds;
}

void CheckMaxSeconds(double seconds, const char* name) {
  if (seconds > 0) return;
  throw py::value_error(std::string(name) + " is " + Number(seconds) + ", expected a number > 0");
}

Vector ToState(const System& system, const py::handle& x) {
  const Vector& nominal = system.get().nominal().x;
  if (py::isinstance<py::array>(x) &&  // the names take longer than the numbers
      py::reinterpret_borrow<py::array>(x).size() == nominal.size()) {
    return ToVector(x, "x0", nominal.size());
  }
  return x.is_none() ? nominal : ToNamedVector(x, "x0", nominal, StateNames(system.description()));
}

Vector ToInput(const System& system, const py::handle& u) {
  const Vector& nominal = system.get().nominal().u;
  return u.is_none() ? nominal : ToNamedVector(u, "inputs", nominal, system.description().inputs);
}

InputSchedule ToSchedule(const System& system, const py::handle& inputs) {
  if (inputs.is_none() || py::isinstance<py::array>(inputs) || !py::hasattr(inputs, "t") ||
      !py::hasattr(inputs, "u")) {
    return InputSchedule::Constant(ToInput(system, inputs));
  }
  const Vector grid = ToVector(inputs.attr("t"), "inputs.t", -1);
  const Matrix values = ToMatrix(inputs.attr("u"), "inputs.u", system.get().num_inputs());
  if (values.rows() != grid.size()) {
    throw py::value_error("inputs.u has " + std::to_string(values.rows()) +
                          " rows, expected one for each of the " + std::to_string(grid.size()) +
                          " instants of inputs.t");
  }
  InputSchedule schedule;
  for (Eigen::Index k = 0; k < grid.size(); ++k) {
    schedule.grid.push_back(grid(k));
    schedule.values.push_back(values.row(k).transpose());
  }
  Validate(system.get(), schedule);
  return schedule;
}

Names StateNames(const SystemDescription& description) {
  Names names = description.coordinates;
  for (const std::string& velocity : description.velocities) names.push_back("d/dt " + velocity);
  return names;
}

Names TangentNames(const SystemDescription& description, const Variables& variables) {
  Names names = description.velocities;
  for (const std::string& velocity : description.velocities) names.push_back("d/dt " + velocity);
  const auto add = [&](const char* kind, const std::string& name) {
    const bool taken = std::find(names.begin(), names.end(), name) != names.end();
    names.push_back(taken ? std::string(kind) + " " + name : name);
  };
  if (variables.inputs) {
    for (const std::string& input : description.inputs) add("input", input);
  }
  for (int index : variables.parameters) {
    add("parameter", description.parameters[static_cast<std::size_t>(index)].name);
  }
  return names;
}

py::tuple ToNames(ConstraintSet contacts, const SystemDescription& description) {
  return py::tuple(py::cast(contacts.Names(description.constraints)));
}

py::list ToNames(const std::vector<ContactMode>& modes, const SystemDescription& description) {
  py::list list;
  for (ContactMode mode : modes) list.append(ToNames(mode, description));
  return list;
}

ConstraintSet ToContacts(const py::handle& names, const SystemDescription& description) {
  if (py::isinstance<py::str>(names)) {
    throw py::type_error("constraints are given as one text, expected a sequence of names");
  }
  ConstraintSet contacts;
  for (const auto& name : names) {
    contacts.Insert(IndexOf("constraint", py::str(name), description.constraints));
  }
  return contacts;
}

int IndexOf(const std::string& kind, const std::string& name, const Names& names) {
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) throw std::invalid_argument(UnknownName(kind, name, names));
  return static_cast<int>(it - names.begin());
}

Variables ToVariables(const py::handle& by, const SystemDescription& description) {
  Names parameters;
  for (const Parameter& parameter : description.parameters) parameters.push_back(parameter.name);
  Names known = parameters;
  known.insert(known.end(), {"state", "inputs", "parameters"});
  if (py::isinstance<py::str>(by)) {
    throw py::type_error("by is one text, expected a sequence, as [\"state\", \"inputs\"]");
  }
  Variables variables;
  const auto add = [&](int index) {
    if (std::find(variables.parameters.begin(), variables.parameters.end(), index) !=
        variables.parameters.end()) {
      throw std::invalid_argument("by names the parameter '" +
                                  parameters[static_cast<std::size_t>(index)] + "' twice");
    }
    variables.parameters.push_back(index);
  };
  for (const auto& entry : by) {
    const std::string name = py::str(entry);
    if (name == "state") continue;
    if (name == "inputs") {
      variables.inputs = true;
    } else if (name == "parameters") {
      for (int k = 0; k < static_cast<int>(parameters.size()); ++k) add(k);
    } else {
      IndexOf("variable", name, known);
      add(IndexOf("variable", name, parameters));
    }
  }
  return variables;
}

ParameterValues ToParameters(const py::handle& mapping) {
  ParameterValues values;
  for (const auto& entry : py::reinterpret_borrow<py::dict>(mapping)) {
    const std::string name = py::str(entry.first);
    try {
      values[name] = entry.second.cast<double>();
    } catch (const py::cast_error&) {
      throw py::type_error("parameter '" + name + "' is " +
                           py::repr(entry.second).cast<std::string>() + ", expected a number");
    }
  }
  return values;
}

std::string Number(double value) { return py::str(py::float_(value)); }

std::string Join(const Names& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

py::array View(const Vector& vector, const py::handle& owner) {
  py::array_t<double> view(vector.size(), vector.data(), owner);
  py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return std::move(view);
}

py::array View(const Matrix& matrix, const py::handle& owner) {
  constexpr py::ssize_t size = sizeof(double);
  py::array_t<double> view({matrix.rows(), matrix.cols()}, {size, size * matrix.rows()},
                           matrix.data(), owner);
  py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return std::move(view);
}

}  // namespace python
}  // namespace contact_flow
