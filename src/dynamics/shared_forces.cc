// SPDX-License-Identifier: BSD-3-Clause
// Forces of contacts whose rows depend on each other, in the dynamics of a contact mode.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "cone_springs.h"
#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "dependent_rows.h"

namespace contact_flow {
namespace {

/// A pivot of a sliding mode below this part of the largest makes it worth to look: where a row is
/// dependent two pivots, of which one is the small part that slips have across each other, have the
/// product of rounding, and three may be.
constexpr double kSmallPivot = 1e-4;
/// Where all stick, rounding of a pivot relative to its row, over the smallest part that others
/// left of theirs before.
constexpr double kPivotRounding = 1e-14;
/// Entries of Z that are rounding, and a push of it that is none, relative.
constexpr double kNoSharedPart = 1e-7, kNoSharedPush = 1e-6;
/// A column that pushes more than this many times its row has units of its own.
constexpr double kLargePush = 100;
/// A pull of springs that is rounding, relative.
constexpr double kNoPull = 1e-12;
/// What springs push out of their cones by is rounding below this, relative.
constexpr double kOutOfCone = 1e-9;

/// Of the shared contacts, in the multipliers of the `active` rows.
std::vector<ForceCone> SharedCones(const MechanicalSystem& system, const ContactMode& mode,
                                   const ConstraintSet& shared, const std::vector<int>& active) {
  std::vector<ForceCone> cones;
  const auto place = [&](int row) {
    return static_cast<int>(std::find(active.begin(), active.end(), row) - active.begin());
  };
  for (int i : shared) {
    const Friction& friction = system.friction()[i];
    const int dimension = mode.LetterOf(i) == Letter::kStick ? friction.dimension : 0;
    cones.push_back(
        {place(i), dimension > 0 ? place(friction.row) : 0, dimension, friction.coefficient});
  }
  return cones;
}

/// By the right sides of all rows the forces λ = unit ∘ ξ of the `loaded` ones with
/// H ξ = rows · right and Zᵀ λ = 0 for all Z with A_Fᵀ Z = 0, F the loaded ones: they are in the
/// range of A_F. G = A P Aᵀ; empty where they are not determined.
Matrix SpringInverse(const Matrix& G, const Matrix& H, const Vector& units, const Matrix& rows,
                     const std::vector<bool>& loaded) {
  std::vector<int> places;
  for (std::size_t k = 0; k < loaded.size(); ++k) {
    if (loaded[k]) places.push_back(static_cast<int>(k));
  }
  const auto f = static_cast<Eigen::Index>(places.size());
  Matrix block(f, f), part(H.rows(), f);
  Vector unit(f);
  for (Eigen::Index i = 0; i < f; ++i) {
    unit(i) = units(places[static_cast<std::size_t>(i)]);
    part.col(i) = H.col(places[static_cast<std::size_t>(i)]);
    for (Eigen::Index j = 0; j < f; ++j) {
      block(i, j) = G(places[static_cast<std::size_t>(i)], places[static_cast<std::size_t>(j)]);
    }
  }
  const RowBasis basis = FindRowBasis(block);
  if (f - basis.freedom.cols() != H.rows()) return {};
  Matrix springs(f, f), right = Matrix::Zero(f, G.rows());
  springs << part, basis.freedom.transpose() * unit.asDiagonal();
  right.topRows(H.rows()) = rows;
  const Matrix solved = unit.asDiagonal() * springs.partialPivLu().solve(right);
  if (!solved.allFinite()) return {};
  Matrix inverse = Matrix::Zero(G.rows(), G.rows());
  for (Eigen::Index i = 0; i < f; ++i)
    inverse.row(places[static_cast<std::size_t>(i)]) = solved.row(i);
  return inverse;
}

/// Where forces that are not unique push: those of equal springs in their cones, where the rows
/// have the right sides `right`; if there are none, without contacts that would pull, and empty
/// where these leave their cones, too. `slack` is
/// the least of all without cones.
Matrix ShareAsSprings(const Matrix& G, const Matrix& H, const Vector& unit, const Matrix& rows,
                      const Vector& right, const std::vector<ForceCone>& cones, double* slack) {
  std::vector<bool> loaded(static_cast<std::size_t>(G.rows()), true);
  Matrix inverse = SpringInverse(G, H, unit, rows, loaded);
  if (inverse.size() == 0) return inverse;
  *slack = LeastSlack(cones, inverse * right);
  if (*slack >= 0) return inverse;
  Matrix range(G.rows(), H.rows());
  const RowBasis basis = FindRowBasis(G);
  for (Eigen::Index i = 0; i < H.rows(); ++i) {
    const int row = basis.rows[static_cast<std::size_t>(i)];
    range.col(i) = G.col(row) / std::sqrt(G(row, row));
  }
  const Matrix by_force = H * unit.cwiseInverse().asDiagonal();
  Matrix in_cones = SolveConeSprings({by_force, range, rows, cones}, right);
  if (in_cones.size() > 0) return in_cones;
  for (std::size_t k = 0; k < cones.size(); ++k) {
    const Vector force = inverse * right;
    const ForceCone* pulls = nullptr;
    for (const ForceCone& cone : cones) {
      const double least =
          pulls == nullptr ? -kNoPull * force.cwiseAbs().maxCoeff() : force(pulls->normal);
      if (force(cone.normal) < least) pulls = &cone;
    }
    if (pulls == nullptr) break;
    loaded[static_cast<std::size_t>(pulls->normal)] = false;
    for (int j = 0; j < pulls->dimension; ++j) {
      loaded[static_cast<std::size_t>(pulls->tangential + j)] = false;
    }
    Matrix others = SpringInverse(G, H, unit, rows, loaded);
    if (others.size() == 0) break;  // no share pushes alone
    inverse = std::move(others);
  }
  const Vector force = inverse * right;
  if (LeastSlack(cones, force) < -kOutOfCone * force.cwiseAbs().maxCoeff()) return {};
  return inverse;
}

}  // namespace

bool ContactDynamics::FindDependence() {
  at_->shared = ConstraintSet();
  const Matrix& G = at_->delassus_inverse;
  bool small = at_->delassus_factor.info() != Eigen::Success;
  double least = 1;
  for (Eigen::Index i = 0; i < G.rows() && !small; ++i) {
    const double pivot = at_->delassus_factor.matrixLLT()(i, i), part = pivot * pivot / G(i, i);
    small = part <= std::max(kDependentRow, kPivotRounding / least);
    least = std::min(least, part);
  }
  if (!small || !G.allFinite() || !(G.diagonal().array() > 0).all()) return false;
  const RowBasis basis = FindRowBasis(G);
  if (basis.freedom.cols() == 0) return false;
  at_->freedom = basis.freedom;
  NoteShared();
  if (at_->shared.Empty()) return false;  // bilateral constraints among themselves
  at_->generalized = basis.PseudoInverse();
  return true;
}

/// Here A_J and W_J differ: independent rows of A, and all multipliers that meet them.
bool ContactDynamics::FindSlidingDependence() {
  at_->shared = at_->springs = ConstraintSet();
  const auto pivots = at_->sliding_factor.matrixLU().diagonal().cwiseAbs();
  if (!(pivots.minCoeff() <= kSmallPivot * pivots.maxCoeff())) return false;
  const Matrix G = at_->reach.transpose() * at_->reach;
  if (!G.allFinite() || !(G.diagonal().array() > 0).all()) return false;
  const RowBasis basis = FindRowBasis(G);
  const Eigen::Index k = G.rows(), r = k - basis.freedom.cols();
  if (r == k) return false;
  // The column of a pad has the friction of its joint, in any units: then by what it pushes.
  Vector size = G.diagonal().cwiseSqrt();
  for (Eigen::Index j = 0; j < k; ++j) {
    const double pushes = at_->push.col(j).norm();
    if (pushes > kLargePush * size(j)) size(j) = pushes;
  }
  const Vector unit = size.cwiseInverse();
  Matrix H(r, k), rows = Matrix::Zero(r, k);
  for (Eigen::Index i = 0; i < r; ++i) {
    const int row = basis.rows[static_cast<std::size_t>(i)];
    rows(i, row) = 1 / std::sqrt(G(row, row));
    H.row(i) = rows(i, row) * at_->delassus_inverse.row(row) * unit.asDiagonal();
    const double largest = H.row(i).cwiseAbs().maxCoeff();
    if (!(largest > 0) || largest * kLargePush >= 1) continue;
    rows(i, row) /= largest;
    H.row(i) /= largest;
  }
  Eigen::FullPivLU<Matrix> factor(H);
  factor.setThreshold(kDependentRow);
  if (factor.rank() < r) return false;
  at_->freedom = unit.asDiagonal() * factor.kernel();
  NoteShared();
  if (at_->shared.Empty()) return false;
  const Matrix any = unit.asDiagonal() * H.completeOrthogonalDecomposition().solve(rows);
  const Matrix Z = at_->freedom;
  at_->generalized = any - Z * (Z.transpose() * Z).ldlt().solve(Z.transpose() * any);
  const double most = (at_->push.cwiseAbs() * Z.cwiseAbs()).maxCoeff();
  if ((at_->push * Z).cwiseAbs().maxCoeff() <= kNoSharedPush * most) return true;
  at_->freedom = basis.freedom;
  NoteShared();
  at_->springs = at_->shared;
  Vector motion = applied_;
  mass_factor_.SolveL(motion);
  const Vector right = -at_->bias - at_->reach.transpose() * motion;
  at_->generalized =
      ShareAsSprings(G, H, unit, rows, right,
                     SharedCones(system_, at_->mode, at_->shared, at_->active), &shared_slack_);
  at_->freedom = Z;
  if (at_->generalized.size() > 0) return true;
  at_->generalized.setZero(k, k);
  at_->regular = false;
  return true;
}

void ContactDynamics::NoteShared() {
  at_->shared = ConstraintSet();
  for (Eigen::Index j = 0; j < at_->freedom.cols(); ++j) {
    const auto column = at_->freedom.col(j).cwiseAbs();
    const double part = kNoSharedPart * column.maxCoeff();
    for (int i : at_->mode - system_.compliant()) {
      const Friction& friction = system_.friction()[i];
      for (Eigen::Index k = 0; k < column.size(); ++k) {
        const int row = at_->active[static_cast<std::size_t>(k)];
        const bool own =
            row == i || (row >= friction.row && row < friction.row + friction.dimension);
        if (own && column(k) > part) at_->shared.Insert(i);
      }
    }
  }
}

void ContactDynamics::SpreadForces(const Vector& multiplier, Vector* force) const {
  force->setZero(n_);
  for (std::size_t k = 0; k < at_->active.size(); ++k) {
    (*force)(at_->active[k]) = multiplier(static_cast<Eigen::Index>(k));
  }
}

/// What is at hand: the smallest forces, and where they are not admissible a search for others.
void ContactDynamics::ShareForces() {
  share_known_ = false;
  const std::vector<ForceCone> cones = SharedCones(system_, at_->mode, at_->shared, at_->active);
  if (!at_->springs.Empty()) return;  // known from ShareAsSprings
  shared_slack_ = LeastSlack(cones, at_->multiplier);
  if (shared_slack_ >= 0) return;
  FindShare();
  ForceShare interior;
  interior.margin = shared_margin_;
  interior.force.resize(at_->multiplier.size());
  for (std::size_t k = 0; k < at_->active.size(); ++k) {
    interior.force(static_cast<Eigen::Index>(k)) = interior_(at_->active[k]);
  }
  at_->multiplier = SmallestShare(cones, at_->multiplier, at_->freedom, interior);
}

void ContactDynamics::FindShare() const {
  if (share_known_) return;
  share_known_ = true;
  const ForceShare interior = MostInterior(
      SharedCones(system_, at_->mode, at_->shared, at_->active), at_->multiplier, at_->freedom);
  shared_margin_ = interior.margin;
  SpreadForces(interior.gradient, &shared_gradient_);
  SpreadForces(interior.force, &interior_);
  for (const Sliding& s : at_->sliding) {
    interior_.segment(s.friction.row, s.friction.dimension) =
        -s.friction.coefficient * interior_(s.constraint) * s.direction.head(s.friction.dimension);
  }
}

}  // namespace contact_flow
