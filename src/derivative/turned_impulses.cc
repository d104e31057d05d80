// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/turned_impulses.h"

#include <Eigen/QR>
#include <vector>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "src/dynamics/rest_impulse.h"

namespace contact_flow {

// The friction of a slip that is turned by an angle pushes across by this part of what it pushes;
// the contacts that come to rest do so all the same.
TurnedImpulses FindTurnedImpulses(const MechanicalSystem& system, const Transition& transition) {
  TurnedImpulses turned;
  if (!(transition.turned > 0)) return turned;
  const int d = system.dof();
  const Vector q = transition.x_minus.head(system.num_positions());
  const Vector v = transition.x_plus.tail(d);
  const InverseInertia inertia(system, q, v);
  const Matrix& A = inertia.terms().jacobian;
  std::vector<int> touching, slipping;  // rows, and where among them slips are
  for (int i : transition.rested - system.compliant()) {
    const Friction& friction = system.friction()[i];
    const bool rubs = friction.dimension == 2 && friction.coefficient > 0;
    touching.push_back(i);
    for (int k = 0; k < friction.dimension; ++k) {
      if (rubs && transition.rested.LetterOf(i) != Letter::kStick) {
        slipping.push_back(static_cast<int>(touching.size()));
      }
      touching.push_back(friction.row + k);
    }
  }
  if (slipping.empty()) return turned;
  Matrix rows(static_cast<Eigen::Index>(touching.size()), d);
  for (std::size_t k = 0; k < touching.size(); ++k) {
    rows.row(static_cast<Eigen::Index>(k)) = A.row(touching[k]);
  }
  const Matrix reach = inertia * rows.transpose();
  const Matrix shares = (rows * reach).completeOrthogonalDecomposition().solve(rows);
  Matrix across(d, static_cast<Eigen::Index>(slipping.size()));
  turned.shares.resize(across.cols(), d);
  for (Eigen::Index k = 0; k < across.cols(); ++k) {
    across.col(k) = transition.turned * reach.col(slipping[static_cast<std::size_t>(k)]);
    turned.shares.row(k) = shares.row(slipping[static_cast<std::size_t>(k)]);
  }

  const std::vector<RestingRow> resting = RestingRows(system, A, v, transition.rested);
  Matrix held(static_cast<Eigen::Index>(resting.size()), d), push(d, held.rows());
  for (std::size_t k = 0; k < resting.size(); ++k) {
    held.row(static_cast<Eigen::Index>(k)) = A.row(resting[k].row);
    push.col(static_cast<Eigen::Index>(k)) = resting[k].push;
  }
  const Matrix pushed = inertia * push;
  turned.across =
      across -
      pushed * (held * pushed).completeOrthogonalDecomposition().solve(Matrix(held * across));
  return turned;
}

}  // namespace contact_flow
