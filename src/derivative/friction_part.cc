// SPDX-License-Identifier: BSD-3-Clause
#include "friction_part.h"

#include <cmath>
#include <random>
#include <vector>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/row_layout.h"

namespace contact_flow {
namespace {

/// Coordinates are moved by this much for entries that vanish at one state alone, so often.
constexpr double kStatesApart = 1e-3;
constexpr int kStatesBeside = 3;
/// A force that an impact elsewhere leaves as it was, relative.
constexpr double kSameForce = 1e-9;

/// Which coordinates belong together.
class Connections {
 public:
  explicit Connections(Eigen::Index count) {
    for (int k = 0; k < count; ++k) next_.push_back(k);
  }

  int Root(int k) const {
    while (Next(k) != k) k = Next(k);
    return k;
  }

  /// Those of the entries of `row` that are not zero do. Returns their root, −1 without any.
  int Connect(const Eigen::RowVectorXd& row) {
    int root = -1;
    for (int k = 0; k < row.size(); ++k) {
      if (row(k) == 0) continue;
      if (root < 0) root = Root(k);
      next_[static_cast<std::size_t>(Root(k))] = root;
    }
    return root;
  }

 private:
  int Next(int k) const { return next_[static_cast<std::size_t>(k)]; }

  std::vector<int> next_;
};

/// Whether no coordinate moves contacts of both sets, at x or around.
bool ShareNothing(const MechanicalSystem& system, const Vector& x, ConstraintSet one,
                  ConstraintSet other) {
  const int nq = system.num_positions(), d = system.dof();
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  Matrix mass = Matrix::Zero(d, d), rows = Matrix::Zero(system.num_rows(), d);
  for (int sample = 0; sample <= kStatesBeside; ++sample) {
    Vector w = Vector::Zero(2 * d);
    for (double& entry : w.head(d)) entry = sample == 0 ? 0 : kStatesApart * normal(random);
    const Vector state = system.Perturb(x, w);
    const InverseInertia inertia(system, state.head(nq), state.tail(d));
    mass += inertia.mass().cwiseAbs();
    rows += inertia.terms().jacobian.cwiseAbs();
  }
  Connections connections(d);
  const RowLayout layout(system);
  for (int k = 0; k < d; ++k) connections.Connect(mass.row(k));
  for (int j = 0; j < system.num_bilateral(); ++j) {
    connections.Connect(rows.row(layout.OfBilateral(j)));
  }
  std::vector<int> members;
  for (int i : one | other) {
    const Friction& friction = system.friction()[static_cast<std::size_t>(i)];
    Eigen::RowVectorXd row = rows.row(i);
    for (int j = 0; j < friction.dimension; ++j) row += rows.row(friction.row + j);
    members.push_back(connections.Connect(row));
  }
  std::vector<char> taken(static_cast<std::size_t>(d), 0);
  for (const bool first : {true, false}) {
    std::size_t place = 0;
    for (int i : one | other) {
      const int member = members[place++];
      if (member < 0 || one.Contains(i) != first) continue;
      char& at = taken[static_cast<std::size_t>(connections.Root(member))];
      if (!first && at != 0) return false;
      if (first) at = 1;
    }
  }
  return true;
}

/// Whether the impacts of a cluster, one or all of them, leave the forces of contacts `aside` as
/// they were: by velocities, forces may depend on them although coordinates do not.
bool LeaveForces(ContactDynamics* dynamics, const Transition& transition, ConstraintSet aside) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  const Vector v = transition.x_minus.tail(d);
  const InverseInertia inertia(system, transition.x_minus.head(nq), v);
  const ContactMode mode = transition.mode_before.Among(aside);
  const auto forces = [&](const Vector& velocity) {
    Vector x = transition.x_minus;
    x.tail(d) = velocity;
    dynamics->Evaluate(x, mode);
    return Vector(dynamics->force());
  };
  const Vector before = forces(v);
  std::vector<Vector> velocities = {transition.x_plus.tail(d)};
  for (int i : transition.activated) {
    const Eigen::RowVectorXd row = inertia.terms().jacobian.row(i);
    const Vector reach = inertia * Vector(row.transpose());
    velocities.emplace_back(v -
                            (1 + system.restitution()(i)) * row.dot(v) / row.dot(reach) * reach);
  }
  for (const Vector& velocity : velocities) {
    const double change = (forces(velocity) - before).cwiseAbs().maxCoeff();
    if (!(change <= kSameForce * before.cwiseAbs().maxCoeff())) return false;
  }
  return true;
}

/// Whether the motion of contacts tells all of their forces.
bool TellForces(const MechanicalSystem& system, const Vector& x, ConstraintSet contacts) {
  if (contacts.Size() < 2) return true;
  const int nq = system.num_positions(), d = system.dof();
  const InverseInertia inertia(system, x.head(nq), x.tail(d));
  const Matrix A = inertia.Rows(contacts);
  const Matrix G = A * (inertia * A.transpose());
  std::vector<int> before;
  for (int row = 0; row < contacts.Size(); ++row) {
    if (!(Independence(G, before, row) > kDependentRow)) return false;
    before.push_back(row);
  }
  return true;
}

}  // namespace

ConstraintSet ContactsWithFriction(const MechanicalSystem& system) {
  ConstraintSet contacts;
  for (int i = 0; system.HasFriction() && i < system.num_constraints(); ++i) {
    if (system.friction()[static_cast<std::size_t>(i)].dimension > 0) contacts.Insert(i);
  }
  return contacts;
}

bool FrictionTakesPart(ContactDynamics* dynamics, const Transition& transition) {
  const MechanicalSystem& system = dynamics->system();
  const ConstraintSet rough = ContactsWithFriction(system);
  if (rough.Empty()) return false;
  const ContactMode before = transition.mode_before, after = transition.mode_after;
  ConstraintSet acting = transition.activated | transition.vanishing | transition.touching |
                         transition.grazed | (before - after) | (after - before);
  for (const EventInstant& instant : transition.instants) {
    if (instant.constraint < system.num_constraints()) acting.Insert(instant.constraint);
  }
  const ConstraintSet aside = before & rough;
  if (!(acting & rough).Empty() || before.Among(aside) != after.Among(aside)) return true;
  const ConstraintSet events = (before - aside) | acting;
  if (!TellForces(system, transition.x_minus, events)) return true;
  if (aside.Empty()) return false;
  return !ShareNothing(system, transition.x_minus, events, aside) ||
         !LeaveForces(dynamics, transition, aside);
}

}  // namespace contact_flow
