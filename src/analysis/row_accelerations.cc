// SPDX-License-Identifier: BSD-3-Clause
#include "row_accelerations.h"

namespace contact_flow {

RowAccelerations::RowAccelerations(ContactDynamics* dynamics, const VectorRef& x,
                                   ContactMode mode) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof();
  const Vector q = x.head(system.num_positions()), v = x.tail(d);
  field_ = dynamics->Field(x, mode);
  dynamics->Differentiate(x, mode);
  const Vector acceleration = dynamics->acceleration(), force = dynamics->force();
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  value_ = terms.jacobian * acceleration + terms.bias;
  terms_ = terms.jacobian.cwiseAbs() * acceleration.cwiseAbs() + terms.bias.cwiseAbs();
  gradient_ = terms.jacobian * dynamics->acceleration_jacobian();
  ResidualJacobian by;
  system.DifferentiateDynamics(q, v, dynamics->u(), mode, acceleration, force, &by);
  gradient_.leftCols(d) += by.constraint_q;
  gradient_.middleCols(d, d) += by.constraint_v;
  const std::vector<int>& parameters = dynamics->variables().parameters;
  if (parameters.empty()) return;
  ParameterJacobian by_parameter;
  system.DifferentiateDynamicsByParameters(q, v, dynamics->u(), mode, acceleration, force,
                                           parameters, &by_parameter);
  gradient_.rightCols(by_parameter.constraint.cols()) += by_parameter.constraint;
}

}  // namespace contact_flow
