// SPDX-License-Identifier: BSD-3-Clause
#include "friction_lift.h"

#include <cmath>
#include <vector>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/piecewise_linear/linear_program.h"

namespace contact_flow {
namespace {

/// Forces are at most so many times the largest one of the base point, or blow up.
constexpr double kMostForce = 1e4;
/// What a linear program leaves.
constexpr double kProgramError = 1e-6;
constexpr int kSides = 8;

}  // namespace

bool NoFrictionLifts(ContactDynamics* dynamics, const Vector& x, ContactMode mode) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  if (!HaveLinearPrograms()) return false;
  dynamics->Evaluate(x, mode);
  const double unit = dynamics->force().cwiseAbs().maxCoeff();
  if (!(unit > 0)) return false;
  const InverseInertia inertia(system, x.head(nq), x.tail(d), dynamics->u(), mode);
  const FrictionFrame frame(system, inertia, mode - system.compliant());
  const FrictionProblem& problem = frame.problem();
  const Vector b = frame.rows() * inertia.FreeAcceleration() + frame.bias();
  const auto m = static_cast<Eigen::Index>(b.size());
  // y = (λ / unit, 1): normal rows, and all of what cannot slip, keep their rate.
  std::vector<Eigen::RowVectorXd> rows;
  Vector lower = Vector::Constant(m + 1, -kMostForce), upper = Vector::Constant(m + 1, kMostForce);
  lower(m) = upper(m) = 1;
  const auto add_equality = [&](Eigen::RowVectorXd row) {
    row /= row.cwiseAbs().maxCoeff();
    rows.push_back(row);
    rows.push_back(-row);
  };
  const auto keep = [&](Eigen::Index row) {
    Eigen::RowVectorXd equation(m + 1);
    equation << unit * problem.G.row(row), b(row);
    add_equality(equation);
  };
  std::vector<Eigen::Index> normals;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const FrictionContact& contact = problem.contacts[k];
    const int i = frame.constraints()[k];
    const Eigen::Index row = problem.Row(k), dimension = contact.dimension;
    normals.push_back(row);
    lower(row) = 0;
    keep(row);
    if (dimension == 0) continue;
    if (std::isinf(contact.coefficient)) {
      for (Eigen::Index j = 0; j < dimension; ++j) keep(row + 1 + j);
    } else if (mode.LetterOf(i) == Letter::kStick) {
      const int sides = dimension == 1 ? 2 : kSides;
      for (int side = 0; side < sides; ++side) {
        Eigen::RowVectorXd cone = Eigen::RowVectorXd::Zero(m + 1);
        cone(row) = contact.coefficient;
        const double angle = 2 * M_PI * side / sides;
        cone(row + 1) = std::cos(angle);
        if (dimension == 2) cone(row + 2) = std::sin(angle);
        rows.push_back(cone);
      }
    } else {
      Vector direction = Vector::Constant(1, SlipSign(mode.LetterOf(i)));
      if (dimension == 2) {
        direction = (frame.rows().middleRows<2>(row + 1) * x.tail(d)).normalized();
      }
      for (Eigen::Index j = 0; j < dimension; ++j) {
        Eigen::RowVectorXd slip = Eigen::RowVectorXd::Zero(m + 1);
        slip(row + 1 + j) = 1;
        slip(row) = contact.coefficient * direction(j);
        add_equality(slip);
      }
    }
  }
  Matrix all(static_cast<Eigen::Index>(rows.size()), m + 1);
  for (std::size_t k = 0; k < rows.size(); ++k) all.row(static_cast<Eigen::Index>(k)) = rows[k];
  LinearProgram program(all, lower, upper);
  for (Eigen::Index row : normals) {
    Vector objective = Vector::Zero(m + 1);
    objective(row) = -1;
    const std::optional<LinearOptimum> least = program.Maximize(objective);
    if (!least || !(-least->value > kProgramError)) return false;
    const std::optional<LinearOptimum> most = program.Maximize(-objective);
    if (!most || !(most->value < 0.9 * kMostForce)) return false;
  }
  return true;
}

}  // namespace contact_flow
