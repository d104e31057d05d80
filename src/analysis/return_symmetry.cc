// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/return_symmetry.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

/// A row counts as the same within this, relative; what is not the same is so by much more.
constexpr double kSameRow = 1e-6;

/// (gap; Da, and T where there is friction) of contact i, on tangents of before the exchange.
Matrix ReturnRows(const MechanicalSystem& system, const ConstraintTerms& terms, int i,
                  const Matrix& exchange) {
  const Friction friction = system.HasFriction() ? system.friction()[i] : Friction();
  Matrix rows(1 + friction.dimension, system.dof());
  rows.row(0) = terms.jacobian.row(i);
  for (int k = 0; k < friction.dimension; ++k) {
    rows.row(1 + k) = terms.jacobian.row(friction.row + k);
  }
  return rows * exchange;
}

}  // namespace

ReturnSymmetry::Coordinate ReturnSymmetry::Find(const MechanicalSystem& system,
                                                const std::string& name) {
  const SystemDescription& names = system.description();
  const auto q = std::find(names.coordinates.begin(), names.coordinates.end(), name);
  if (q == names.coordinates.end()) {
    throw std::invalid_argument(UnknownName("coordinate", name, names.coordinates));
  }
  const auto v = std::find(names.velocities.begin(), names.velocities.end(), name);
  if (v == names.velocities.end()) {
    throw std::invalid_argument("coordinate '" + name + "' has no velocity of its own");
  }
  return {static_cast<int>(q - names.coordinates.begin()),
          static_cast<int>(v - names.velocities.begin())};
}

ReturnSymmetry& ReturnSymmetry::Exchange(const MechanicalSystem& system, const std::string& first,
                                         const std::string& second) {
  const std::pair<Coordinate, Coordinate> pair = {Find(system, first), Find(system, second)};
  std::vector<int> taken;
  for (const auto& [a, b] : exchanged_) taken.insert(taken.end(), {a.position, b.position});
  const auto again = [&](const Coordinate& one) {
    return std::count(taken.begin(), taken.end(), one.position) > 0;
  };
  if (pair.first.position == pair.second.position || again(pair.first) || again(pair.second)) {
    throw std::invalid_argument("coordinates '" + first + "' and '" + second +
                                "' cannot change places: each may, with one other");
  }
  exchanged_.push_back(pair);
  return *this;
}

ReturnSymmetry& ReturnSymmetry::Shift(const MechanicalSystem& system, const std::string& coordinate,
                                      double amount) {
  shifted_.emplace_back(Find(system, coordinate), amount);
  return *this;
}

ReturnSymmetry& ReturnSymmetry::Travel(const MechanicalSystem& system,
                                       const std::vector<std::string>& coordinates) {
  for (const std::string& name : coordinates) travelling_.push_back(Find(system, name));
  return *this;
}

Vector ReturnSymmetry::Apply(const MechanicalSystem& system, const VectorRef& start,
                             const VectorRef& x) const {
  Vector y = Move(system, Way(system, start, x), x);
  if (!travelling_.empty()) y(travelling_.front().position) = start(travelling_.front().position);
  return y;
}

double ReturnSymmetry::Way(const MechanicalSystem& system, const VectorRef& start,
                           const VectorRef& x) const {
  if (travelling_.empty()) return 0;
  const int first = travelling_.front().position;
  return Move(system, 0, x)(first) - start(first);
}

Vector ReturnSymmetry::Move(const MechanicalSystem& system, double way, const VectorRef& x) const {
  const int nq = system.num_positions();
  Vector y = x;
  for (const auto& [a, b] : exchanged_) {
    std::swap(y(a.position), y(b.position));
    std::swap(y(nq + a.velocity), y(nq + b.velocity));
  }
  for (const auto& [coordinate, amount] : shifted_) y(coordinate.position) += amount;
  for (const Coordinate& coordinate : travelling_) y(coordinate.position) -= way;
  return y;
}

Vector ReturnSymmetry::Undo(const MechanicalSystem& system, const VectorRef& x) const {
  const int nq = system.num_positions();
  Vector y = x;
  for (const auto& [coordinate, amount] : shifted_) y(coordinate.position) -= amount;
  for (const auto& [a, b] : exchanged_) {
    std::swap(y(a.position), y(b.position));
    std::swap(y(nq + a.velocity), y(nq + b.velocity));
  }
  return y;
}

Matrix ReturnSymmetry::Exchanged(const MechanicalSystem& system) const {
  const int d = system.dof();
  Matrix E = Matrix::Identity(2 * d, 2 * d);
  for (const auto& [a, b] : exchanged_) {
    for (const int offset : {0, d}) E.row(offset + a.velocity).swap(E.row(offset + b.velocity));
  }
  return E;
}

Matrix ReturnSymmetry::Tangent(const MechanicalSystem& system) const {
  Matrix tangent = Exchanged(system);
  if (travelling_.empty()) return tangent;
  const Eigen::RowVectorXd first = tangent.row(travelling_.front().velocity);
  for (const Coordinate& coordinate : travelling_) tangent.row(coordinate.velocity) -= first;
  return tangent;
}

Matrix ReturnSymmetry::Along(const MechanicalSystem& system) const {
  Matrix along = Matrix::Zero(2 * system.dof(), travelling_.empty() ? 0 : 1);
  for (const Coordinate& coordinate : travelling_) along(coordinate.velocity, 0) = 1;
  return along;
}

Matrix ReturnSymmetry::Slice(const MechanicalSystem& system) const {
  Matrix row = Matrix::Zero(travelling_.empty() ? 0 : 1, 2 * system.dof());
  if (!travelling_.empty()) row(0, travelling_.front().velocity) = 1;
  return row;
}

SymmetryImage ImageOf(const MechanicalSystem& system, const VectorRef& u,
                      const ReturnSymmetry& symmetry, const VectorRef& x, ContactMode mode,
                      const VectorRef& image) {
  const int d = system.dof(), nq = system.num_positions(), n = system.num_constraints();
  SymmetryImage result;
  ConstraintTerms before, after;
  system.Constraints(x.head(nq), x.tail(d), &before);
  system.Constraints(image.head(nq), image.tail(d), &after);
  const Matrix E = symmetry.Exchanged(system).topLeftCorner(d, d);
  const Matrix same = Matrix::Identity(d, d);
  for (int i : mode) {
    const Matrix rows = ReturnRows(system, before, i, same);
    const double size = rows.cwiseAbs().maxCoeff();
    int best = -1;
    double distance = std::numeric_limits<double>::infinity();
    for (int j = 0; j < n; ++j) {
      const Matrix other = ReturnRows(system, after, j, E);
      if (other.rows() != rows.rows()) continue;
      const double apart =
          (other - rows).cwiseAbs().maxCoeff() / size + std::abs(after.gap(j) - before.gap(i));
      if (apart >= distance) continue;
      distance = apart;
      best = j;
    }
    if (!(distance <= kSameRow)) {
      result.reason = "contact '" + system.description().constraints[i] + "' has become none";
      return result;
    }
    result.residual = std::max(result.residual, distance);
    result.mode.Set(best, mode.LetterOf(i));
  }
  Matrix M, M_image;
  Vector h, h_image;
  system.Dynamics(x.head(nq), x.tail(d), u, mode, &M, &h);
  system.Dynamics(image.head(nq), image.tail(d), u, result.mode, &M_image, &h_image);
  result.residual = std::max(
      {result.residual, (M_image - E * M * E).cwiseAbs().maxCoeff() / M.cwiseAbs().maxCoeff(),
       (h_image - E * h).cwiseAbs().maxCoeff() /
           std::max(h.cwiseAbs().maxCoeff(), std::numeric_limits<double>::min())});
  return result;
}

}  // namespace contact_flow
