// SPDX-License-Identifier: BSD-3-Clause
#include "dependent_words.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "contact_flow/dynamics/complementarity.h"
#include "dependent_rows.h"

namespace contact_flow {
namespace {

/// Rows that depend on others vanish with them up to this, and forces push by less than this where
/// they do not push, relative.
constexpr double kConsistent = 1e-7, kNoPush = 1e-6;
/// A motion that breaks an inequality by more than this needs no search for forces, relative.
constexpr double kBroken = 1e-3;

Matrix BlockOf(const Matrix& G, const std::vector<int>& rows) {
  const auto m = static_cast<Eigen::Index>(rows.size());
  Matrix block(m, m);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      block(i, j) = G(rows[static_cast<std::size_t>(i)], rows[static_cast<std::size_t>(j)]);
    }
  }
  return block;
}

}  // namespace

ImpliedLetters::ImpliedLetters(const FrictionProblem& problem) : problem_(problem) {
  const Matrix& G = problem.G;
  if (G.rows() < 2 || !G.allFinite() || !(G.diagonal().array() > 0).all()) return;
  any_ = FindRowBasis(G).freedom.cols() > 0;
}

std::vector<int> ImpliedLetters::Rows(const std::vector<Letter>& letters) const {
  std::vector<int> rows;
  for (std::size_t i = 0; i < letters.size(); ++i) {
    if (letters[i] == Letter::kOpen) continue;
    const int row = problem_.Row(i);
    rows.push_back(row);
    if (letters[i] != Letter::kStick) continue;
    for (int k = 1; k <= problem_.contacts[i].dimension; ++k) rows.push_back(row + k);
  }
  return rows;
}

/// The row vanishes where those of the basis do: it depends on them, and what is asked of it is
/// what is asked of them. A wall that is a point's second contact slips where the floor, along
/// whose normal it slips, throws it back.
bool ImpliedLetters::Depends(int row, const std::vector<int>& basis) const {
  if (Independence(problem_.G, basis, row) > kDependentRow) return false;
  const auto size = static_cast<Eigen::Index>(basis.size());
  Vector coupling(size), asked(size);
  for (Eigen::Index k = 0; k < size; ++k) {
    coupling(k) = problem_.G(row, basis[static_cast<std::size_t>(k)]);
    asked(k) = problem_.b(basis[static_cast<std::size_t>(k)]);
  }
  const Vector parts = BlockOf(problem_.G, basis).ldlt().solve(coupling);
  const double scale = problem_.b.size() > 0 ? problem_.b.cwiseAbs().maxCoeff() : 0;
  return std::abs(problem_.b(row) - parts.dot(asked)) <= kConsistent * scale;
}

bool ImpliedLetters::Dependent(const std::vector<Letter>& letters) const {
  const std::vector<int> rows = Rows(letters);
  return !rows.empty() && FindRowBasis(BlockOf(problem_.G, rows)).freedom.cols() > 0;
}

bool ImpliedLetters::Change(const std::vector<Letter>& letters) const {
  const std::vector<int> rows = Rows(letters);
  if (rows.empty()) return false;
  std::vector<int> basis;
  for (int place : FindRowBasis(BlockOf(problem_.G, rows)).rows) {
    basis.push_back(rows[static_cast<std::size_t>(place)]);
  }
  for (std::size_t i = 0; i < letters.size(); ++i) {
    const FrictionContact& contact = problem_.contacts[i];
    const int row = problem_.Row(i);
    if (letters[i] == Letter::kOpen && Depends(row, basis)) return true;
    const bool begins = letters[i] != Letter::kOpen && letters[i] != Letter::kStick &&
                        contact.dimension > 0 && !contact.slips;
    bool held = begins;
    for (int k = 1; held && k <= contact.dimension; ++k) held = Depends(row + k, basis);
    if (held) return true;
  }
  return false;
}

std::vector<Letter> ImpliedLetters::Stuck(const std::vector<Letter>& letters) const {
  std::vector<Letter> stuck = letters;
  const std::vector<int> rows = Rows(letters);
  if (rows.empty()) return stuck;
  std::vector<int> basis;
  for (int place : FindRowBasis(BlockOf(problem_.G, rows)).rows) {
    basis.push_back(rows[static_cast<std::size_t>(place)]);
  }
  for (std::size_t i = 0; i < letters.size(); ++i) {
    const FrictionContact& contact = problem_.contacts[i];
    if (contact.dimension == 0 || contact.slips || !(contact.coefficient > 0)) continue;
    const int row = problem_.Row(i);
    bool held = letters[i] != Letter::kOpen || Depends(row, basis);
    for (int k = 1; held && k <= contact.dimension; ++k) held = Depends(row + k, basis);
    if (held) stuck[i] = Letter::kStick;
  }
  return stuck;
}

bool SolveDependentWord(const FrictionProblem& problem, const Matrix& columns,
                        const std::vector<int>& rows, bool share, FrictionSolution* solution) {
  const Matrix& G = problem.G;
  const auto m = static_cast<Eigen::Index>(rows.size());
  const RowBasis basis = FindRowBasis(BlockOf(G, rows));
  const Eigen::Index r = m - basis.freedom.cols();
  if (r == m) return false;  // a singular matrix of independent rows: no law
  const Matrix push = G * columns;
  Vector unit(m), rhs(r);
  for (Eigen::Index k = 0; k < m; ++k) {
    const int row = rows[static_cast<std::size_t>(k)];
    unit(k) = 1 / std::sqrt(G(row, row));
  }
  Matrix H(r, m);
  for (Eigen::Index k = 0; k < r; ++k) {
    const int place = basis.rows[static_cast<std::size_t>(k)];
    const int row = rows[static_cast<std::size_t>(place)];
    H.row(k) = unit(place) * push.row(row) * unit.asDiagonal();
    rhs(k) = -unit(place) * problem.b(row);
  }
  Eigen::FullPivLU<Matrix> factor(H);
  factor.setThreshold(kDependentRow);
  if (factor.rank() < r) return false;
  const Matrix Z = unit.asDiagonal() * WithoutRounding(factor.kernel());
  Vector multiplier = unit.asDiagonal() * H.completeOrthogonalDecomposition().solve(rhs);
  multiplier -= Z * (Z.transpose() * Z).ldlt().solve(Z.transpose() * multiplier);
  if (!multiplier.allFinite()) return false;
  solution->force = columns * multiplier;
  solution->result = G * solution->force + problem.b;
  const double scale = problem.b.cwiseAbs().maxCoeff();
  for (int row : rows) {
    if (std::abs(solution->result(row)) > kConsistent * scale) return false;
  }
  const Matrix moved = G * columns * Z;
  const double size = (G.cwiseAbs() * columns.cwiseAbs() * Z.cwiseAbs()).maxCoeff();
  solution->many = moved.cwiseAbs().maxCoeff() > kNoPush * size;
  if (!share) return true;
  // Forces in their cones; and, where they decide the motion, a motion that fits.
  std::vector<ForceCone> cones;
  Vector values = multiplier;
  Matrix freedom = Z;
  const auto motion = [&](double value, const Eigen::RowVectorXd& change) {
    if (!solution->many) return value >= -kBroken * scale;
    const auto place = static_cast<int>(values.size());
    values.conservativeResize(place + 1);
    values(place) = value;
    freedom.conservativeResize(place + 1, Eigen::NoChange);
    freedom.row(place) = change;
    cones.push_back({place, 0, 0, 0, 1});
    return true;
  };
  int place = 0;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const FrictionContact& contact = problem.contacts[i];
    const Letter letter = solution->letters[i];
    const int row = problem.Row(i);
    if (letter == Letter::kOpen) {
      if (!motion(solution->result(row), moved.row(row))) return false;
      continue;
    }
    const bool sticks = letter == Letter::kStick;
    const int dimension = sticks ? contact.dimension : 0;
    cones.push_back({place, place + 1, dimension, contact.coefficient, 1 / G(row, row)});
    place += 1 + dimension;
    if (sticks || contact.dimension == 0 || contact.slips) continue;
    const auto d = solution->directions[i].head(contact.dimension);
    const double slip = d.dot(solution->result.segment(row + 1, contact.dimension));
    const Eigen::RowVectorXd change = d.transpose() * moved.middleRows(row + 1, contact.dimension);
    if (!motion(slip, change)) return false;
  }
  const ForceShare interior = MostInterior(cones, values, freedom);
  if (!(interior.margin > -kBroken * scale)) return false;
  if (solution->many) {
    solution->force = solution->interior = columns * interior.force.head(m);
    solution->result = G * solution->force + problem.b;
    return true;
  }
  solution->interior = columns * interior.force;
  solution->force = columns * SmallestShare(cones, multiplier, Z, interior);
  return true;
}

}  // namespace contact_flow
