// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/mechanical_system.h"

#include <stdexcept>

#include "contact_flow/nearest_name.h"

namespace contact_flow {

Vector MechanicalSystem::Perturb(const VectorRef& x, const VectorRef& w) const {
  const int d = dof(), nq = num_positions();
  Vector result(nq + d);
  result << space_.Retract(x.head(nq), w.head(d)), x.tail(d) + w.segment(d, d);
  return result;
}

Vector MechanicalSystem::Separation(const VectorRef& to, const VectorRef& from) const {
  const int d = dof(), nq = num_positions();
  Vector w(2 * d);
  w << space_.Difference(to.head(nq), from.head(nq)), to.tail(d) - from.tail(d);
  return w;
}

std::vector<int> ParameterIndices(const SystemDescription& description,
                                  const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const Parameter& parameter : description.parameters) known.push_back(parameter.name);
  std::vector<int> indices;
  for (const std::string& name : names) {
    int found = -1;
    for (std::size_t k = 0; k < known.size(); ++k) {
      if (known[k] == name) found = static_cast<int>(k);
    }
    if (found < 0) throw std::invalid_argument(UnknownName("parameter", name, known));
    indices.push_back(found);
  }
  return indices;
}

}  // namespace contact_flow
