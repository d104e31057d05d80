// SPDX-License-Identifier: BSD-3-Clause
#include "directions.h"

namespace contact_flow {
namespace python {

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
    return sign * Vector::Unit(cols, IndexOf("tangent", name, names()));
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
