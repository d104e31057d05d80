// SPDX-License-Identifier: BSD-3-Clause
#include "free_slips.h"

#include <sstream>

namespace contact_flow {
namespace {

/// A slip is zero below this, relative to its terms.
constexpr double kZero = 1e-9;

/// T v of contact i, as a unit vector, or zero.
Vector Direction(const MechanicalSystem& system, const Vector& x, int i) {
  const int d = system.dof(), nq = system.num_positions();
  const Friction& friction = system.friction()[i];
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  const Matrix T = terms.jacobian.middleRows(friction.row, friction.dimension);
  const Vector slip = T * x.tail(d);
  const double size = (T.cwiseAbs() * x.tail(d).cwiseAbs()).norm();
  return slip.norm() > kZero * size ? slip.normalized() : Vector::Zero(slip.size());
}

}  // namespace

Status CheckFreeSlips(const ContactDynamics& dynamics, const Arc& arc) {
  const MechanicalSystem& system = dynamics.system();
  const std::vector<int>& parameters = dynamics.variables().parameters;
  if (!system.HasFriction() || parameters.empty() || arc.t_end == arc.t_begin) return {};
  const Matrix by_parameter = system.DifferentiateFriction(parameters);
  for (int i : arc.mode - system.compliant()) {
    const Friction& friction = system.friction()[i];
    if (friction.dimension == 0 || friction.coefficient > 0 || by_parameter.row(i).isZero(0)) {
      continue;
    }
    const Vector begin = Direction(system, arc.x_begin, i), end = Direction(system, arc.x_end, i);
    if (begin.dot(end) > 0) continue;
    std::ostringstream message;
    message.precision(12);
    message << "from t = " << arc.t_begin << " s to " << arc.t_end << " s the contact '"
            << system.description().constraints[i]
            << "', whose friction is 0 and a variable, does not slip one way: which way friction "
               "would act is not decided";
    return {Outcome::kNotDifferentiable, message.str()};
  }
  return {};
}

}  // namespace contact_flow
