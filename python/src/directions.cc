// SPDX-License-Identifier: BSD-3-Clause
#include "directions.h"

#include <algorithm>
#include <string>
#include <vector>

namespace contact_flow {
namespace python {
namespace {

/// The tangent of that name; "input knee" and "parameter mass" are those of what is called so.
int IndexOfTangent(const MechanicalSystem& system, const Variables& variables,
                   const std::string& name) {
  const std::vector<std::string> names = TangentNames(system.description(), variables);
  const auto inputs = names.begin() + 2 * system.dof();
  const auto parameters = inputs + (variables.inputs ? system.num_inputs() : 0);
  const auto find = [&](const std::string& kind, auto begin, auto end) {
    if (name.compare(0, kind.size(), kind) != 0) return names.end();
    const auto at = std::find(begin, end, name.substr(kind.size()));
    return at == end ? names.end() : at;
  };
  auto at = find("", names.begin(), names.end());
  if (at == names.end()) at = find("input ", inputs, parameters);
  if (at == names.end()) at = find("parameter ", parameters, names.end());
  if (at == names.end()) return IndexOf("tangent", name, names);  // which says what is near
  return static_cast<int>(at - names.begin());
}

}  // namespace

Vector ToDirection(const MechanicalSystem& system, const Variables& variables,
                   const py::handle& w) {
  const Eigen::Index states = 2 * system.dof();
  const Eigen::Index cols = states + variables.Size(system);
  const auto names = [&] { return TangentNames(system.description(), variables); };
  if (py::isinstance<py::str>(w)) {
    std::string name = py::str(w);
    double sign = 1;
    if (!name.empty() && (name[0] == '+' || name[0] == '-')) {
      sign = name[0] == '-' ? -1 : 1;
      name.erase(0, 1);
    }
    return sign * Vector::Unit(cols, IndexOfTangent(system, variables, name));
  }
  if (py::isinstance<py::dict>(w)) {
    const Vector named = ToNamedVector(w, "w", Vector::Zero(cols), names());
    if (!named.allFinite()) throw py::value_error("w has a number that is not finite");
    return named;
  }
  Vector direction = ToVector(w, "w", -1);
  if (direction.size() == states && cols > states) {
    direction.conservativeResizeLike(Vector::Zero(cols));
  }
  if (direction.size() != cols) {
    throw py::value_error("w has " + std::to_string(direction.size()) + " numbers, expected " +
                          std::to_string(cols) + ": " + Join(names()));
  }
  if (!direction.allFinite()) throw py::value_error("w has a number that is not finite");
  return direction;
}

void CheckAdmitted(const StartDirections& directions, const Vector& w, const std::string& name) {
  using Kind = StartDirections::Judgement::Kind;
  const StartDirections::Judgement judgement = directions.Judge(w);
  if (judgement.ok()) return;
  throw py::value_error(name + " " + directions.Sentence(judgement) +
                        (judgement.kind == Kind::kLeavesMode ? "; project(w) keeps it" : ""));
}

}  // namespace python
}  // namespace contact_flow
