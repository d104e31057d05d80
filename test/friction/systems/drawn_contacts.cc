// SPDX-License-Identifier: BSD-3-Clause
#include "test/friction/systems/drawn_contacts.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace contact_flow {
namespace test {
namespace {

/// Moves v so that contacts rest, and those stick that cannot slip, or all.
void Rest(const RandomContacts& system, bool still, Vector* x) {
  const int d = system.dof();
  ConstraintTerms terms;
  system.Constraints(x->head(d), x->tail(d), &terms);
  for (const Friction& friction : system.friction()) {
    if (!still && std::isfinite(friction.coefficient)) {
      terms.jacobian.middleRows(friction.row, friction.dimension).setZero();
    }
  }
  const Vector v = x->tail(d);
  x->tail(d) -= terms.jacobian.completeOrthogonalDecomposition().solve(terms.jacobian * v);
}

/// Moves v so that the first two contacts approach alike.
void Level(const RandomContacts& system, Vector* x) {
  const int d = system.dof();
  ConstraintTerms terms;
  system.Constraints(x->head(d), x->tail(d), &terms);
  const Vector a = terms.jacobian.row(0) - terms.jacobian.row(1);
  x->tail(d) -= a * (a.dot(x->tail(d)) / a.squaredNorm());
}

}  // namespace

/// Lengths in `unit` m: q = unit·q̃, and times as they are.
DrawnContacts DrawContacts(unsigned seed, int rows) {
  Dice dice(seed);
  const int n = 1 + static_cast<int>(seed % 4), d = n * (rows + 1) + static_cast<int>(seed % 3);
  const double unit = dice.Chance(0.2) ? (dice.Chance(0.5) ? 1e-4 : 1e4) : 1;
  ContactCoefficients c;
  c.rows = rows;
  const Matrix S = dice.Normals(d, d, 0.5 / std::sqrt(d));
  c.mass = Matrix::Identity(d, d) + S * S.transpose();
  c.stiffness = 10 * S.transpose() * S;
  c.damping = dice.Uniform(0, 1) * Matrix::Identity(d, d);
  c.normals = Matrix::Zero(n, d);
  c.tangents = Matrix::Zero(n * rows, d);
  c.load = dice.Normals(d, 1, 1);
  // Contact i has the coordinates (rows+1) i and those behind it for its own, and some of others.
  for (int i = 0; i < n; ++i) {
    const int first = (rows + 1) * i;
    c.normals(i, first) = 1;
    c.load(first) -= dice.Uniform(4, 12);
    for (int k = 0; k < rows; ++k) {
      c.tangents(rows * i + k, first + 1 + k) = 1;
      c.load(first + 1 + k) += 3 * dice.Normal();
    }
    c.curvatures.push_back(Matrix::Zero(d, d));
    if (dice.Chance(0.5)) {
      const Matrix Q = dice.Normals(d, d, 0.15);
      c.curvatures[i] = (Q + Q.transpose()) / unit;
    }
  }
  c.normals += dice.Normals(n, d, 0.1);
  c.tangents += dice.Normals(n * rows, d, 0.1);
  for (int k = 0; k < d; ++k) {
    c.turning.push_back(dice.Chance(0.5) ? Matrix(dice.Normals(n * rows, d, 0.1) / unit)
                                         : Matrix(Matrix::Zero(n * rows, d)));
  }
  c.load *= unit;
  c.offset = Vector::Zero(n);
  c.friction.resize(n);
  c.restitution.resize(n);
  const bool rest = dice.Chance(0.25), together = n > 1 && !rest && dice.Chance(0.4);
  const double height = dice.Uniform(0.02, 0.2);
  for (int i = 0; i < n; ++i) {
    c.friction(i) = dice.Chance(0.2) ? Friction::kNoSlip : dice.Uniform(0.05, 1);
    c.restitution(i) = dice.Chance(0.85) ? 0 : dice.Uniform(0.05, 0.6);
    if (!rest) c.offset(i) = unit * (together && i < 2 ? height : dice.Uniform(0.02, 0.3));
  }
  if (together) c.restitution(1) = c.restitution(0);
  DrawnContacts drawn;
  drawn.system = std::make_unique<RandomContacts>(c);
  drawn.size = unit;
  drawn.x = Vector::Zero(2 * d);
  drawn.x.tail(d) = unit * dice.Normals(d, 1, 1);
  for (int i = 0; i < n; ++i) drawn.x(d + (rows + 1) * i) = -unit * dice.Uniform(0, 1);
  if (rest) Rest(*drawn.system, dice.Chance(0.5), &drawn.x);
  if (together) Level(*drawn.system, &drawn.x);
  return drawn;
}

SimulateOptions TightOptions(double size) {
  SimulateOptions options;
  options.relative_tolerance = 1e-12;
  options.absolute_tolerance = std::max(1e-15, 1e-12 * size);
  options.gap_tolerance = 1e-9 * size;
  options.speed_tolerance = 1e-9 * size;
  return options;
}

}  // namespace test
}  // namespace contact_flow
