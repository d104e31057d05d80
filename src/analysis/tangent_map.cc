// SPDX-License-Identifier: BSD-3-Clause
#include "tangent_map.h"

namespace contact_flow {

PiecewiseLinearMap TangentMap(const BDerivative& B) {
  const std::size_t limit = B.options.max_pieces;
  PiecewiseLinearMap map = PiecewiseLinearMap::Linear(B.arcs.front());
  for (std::size_t k = 0; k < B.events.size(); ++k) {
    map = B.events[k].Pieces(B.options.max_activations_for_pieces).After(map, limit);
    map = PiecewiseLinearMap::Linear(B.arcs[k + 1]).After(map, limit);
  }
  return map;
}

Vector GapGradient(const MechanicalSystem& system, const VectorRef& x, int i,
                   const Variables& variables) {
  const int d = system.dof(), nq = system.num_positions(), k = variables.Size(system);
  const int parameters = static_cast<int>(variables.parameters.size());
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  Vector gradient = Vector::Zero(2 * d + k);
  gradient.head(d) = terms.jacobian.row(i).transpose();
  if (parameters > 0) {
    ParameterJacobian by_parameter;
    system.DifferentiateImpactByParameters(x.head(nq), Vector::Zero(d),
                                           Vector::Zero(terms.gap.size()), x.tail(d),
                                           variables.parameters, &by_parameter);
    gradient.tail(parameters) = by_parameter.gap.row(i).transpose();
  }
  return gradient;
}

}  // namespace contact_flow
