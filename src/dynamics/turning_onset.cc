// SPDX-License-Identifier: BSD-3-Clause
#include "turning_onset.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <vector>

#include "dependent_rows.h"

namespace contact_flow {
namespace {

/// Motions that differ by less than this are one, relative.
constexpr double kSameTurning = 1e-8;
/// A normal force below this part of the largest has vanished; changes below it are rounding.
constexpr double kNoForce = 1e-6;
/// Speeds that miss what bodies can do by less than this are possible; and are equal, relative.
constexpr double kPossible = 1e-6;

bool BeginsInSpace(const FrictionProblem& problem, const FrictionSolution& word, std::size_t k) {
  const FrictionContact& contact = problem.contacts[k];
  return word.letters[k] == Letter::kSlip && contact.dimension == 2 && !contact.slips &&
         contact.coefficient > 0;
}

/// What the slips of a word that begin have for directions: by row that the word holds, or that
/// slips so, the rates d of contact k in column k.
struct Onsets {
  std::vector<int> rows;
  Matrix rates;  // [rows × contacts]
  bool any = false;
};

Onsets OnsetsOf(const FrictionProblem& problem, const FrictionSolution& word) {
  Onsets onsets;
  const std::size_t n = problem.contacts.size();
  onsets.rates = Matrix::Zero(problem.G.rows(), static_cast<Eigen::Index>(n));
  for (std::size_t k = 0; k < n; ++k) {
    if (word.letters[k] == Letter::kOpen) continue;
    const int row = problem.Row(k);
    onsets.rows.push_back(row);
    const bool begins = BeginsInSpace(problem, word, k);
    onsets.any = onsets.any || begins;
    if (word.letters[k] != Letter::kStick && !begins) continue;
    for (int j = 0; j < problem.contacts[k].dimension; ++j) {
      const auto place = static_cast<Eigen::Index>(onsets.rows.size());
      if (begins) onsets.rates(place, static_cast<Eigen::Index>(k)) = word.directions[k](j);
      onsets.rows.push_back(row + 1 + j);
    }
  }
  onsets.rates.conservativeResize(static_cast<Eigen::Index>(onsets.rows.size()), Eigen::NoChange);
  return onsets;
}

/// The speeds nearest to 1 with which what begins to slip may move, by contact; some may vanish, or
/// have the wrong sign.
Vector PossibleSpeeds(const FrictionProblem& problem, const FrictionSolution& word) {
  const Onsets onsets = OnsetsOf(problem, word);
  std::vector<Eigen::Index> begun;
  Vector speeds = Vector::Zero(onsets.rates.cols());
  for (Eigen::Index k = 0; k < speeds.size(); ++k) {
    if (!BeginsInSpace(problem, word, static_cast<std::size_t>(k))) continue;
    begun.push_back(k);
    speeds(k) = 1;
  }
  if (begun.empty()) return speeds;
  // Zᵀ A v = 0 for all v.
  const Matrix all =
      FindRowBasis(Matrix(problem.G(onsets.rows, onsets.rows))).freedom.transpose() * onsets.rates;
  Matrix missed(all.rows(), static_cast<Eigen::Index>(begun.size()));
  for (std::size_t j = 0; j < begun.size(); ++j) {
    missed.col(static_cast<Eigen::Index>(j)) = all.col(begun[j]);
  }
  const Vector equal = Vector::Ones(missed.cols());
  if (missed.size() == 0 || !((missed * equal).cwiseAbs().maxCoeff() > kPossible)) return speeds;
  const Eigen::JacobiSVD<Matrix> svd(missed, Eigen::ComputeFullV);
  Matrix possible = svd.matrixV();
  for (Eigen::Index j = 0; j < svd.singularValues().size(); ++j) {
    if (svd.singularValues()(j) > kPossible * svd.singularValues()(0)) possible.col(j).setZero();
  }
  const Vector found = possible * (possible.transpose() * equal);
  for (std::size_t j = 0; j < begun.size(); ++j) {
    speeds(begun[j]) = found(static_cast<Eigen::Index>(j));
  }
  return speeds;
}

}  // namespace

std::optional<FrictionSolution> FindTurningOnset(const FrictionProblem& problem,
                                                 const FrictionSolution& stuck, double border) {
  FrictionSolution word = stuck;
  const Vector& share = stuck.interior.size() > 0 ? stuck.interior : stuck.force;
  const double scale = problem.b.cwiseAbs().maxCoeff(), most = share.cwiseAbs().maxCoeff();
  const auto may_miss = [&](std::size_t k) {
    const double slack = problem.slack.size() > 0 ? problem.slack(static_cast<int>(k)) : 0;
    return border * scale + 2 * slack;
  };
  std::vector<std::size_t> begin;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const FrictionContact& contact = problem.contacts[k];
    const int row = problem.Row(k);
    if (word.letters[k] == Letter::kOpen) continue;
    if (!(share(row) > kNoForce * most)) return std::nullopt;
    const bool may = word.letters[k] == Letter::kStick && contact.dimension == 2;
    if (!may || !std::isfinite(contact.coefficient)) continue;
    const Eigen::Vector2d held = share.segment<2>(row + 1);
    const double slack = contact.coefficient * share(row) - held.norm();
    if (problem.G(row, row) * std::abs(slack) > may_miss(k)) continue;
    word.letters[k] = Letter::kSlip;
    word.directions[k] = -held.normalized();
    begin.push_back(k);
  }
  // Those on their cones by a share that might be another one cannot move.
  for (bool moves = false; !moves && !begin.empty();) {
    const Vector speeds = PossibleSpeeds(problem, word);
    moves = true;
    for (auto k = begin.begin(); k != begin.end();) {
      const bool stays = !(speeds(static_cast<Eigen::Index>(*k)) > kPossible);
      if (stays) word.letters[*k] = Letter::kStick;
      moves = moves && !stays;
      k = stays ? begin.erase(k) : k + 1;
    }
  }
  word.interior.resize(0);
  if (begin.empty() || !SolveWord(problem, &word) || word.many) return std::nullopt;
  if (!((word.result - stuck.result).cwiseAbs().maxCoeff() <= kSameTurning * scale)) {
    return std::nullopt;
  }
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    if (word.letters[k] == stuck.letters[k]) continue;  // others may share theirs in other ways
    const int row = problem.Row(k);
    if (!(std::abs(word.force(row) - share(row)) <= kNoForce * most)) return std::nullopt;
  }
  word.turns = true;
  return word;
}

bool SlipsMayBegin(const FrictionProblem& problem, const FrictionSolution& word) {
  const double still = kSameTurning * problem.b.cwiseAbs().maxCoeff();
  const Vector speeds = PossibleSpeeds(problem, word);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    if (!BeginsInSpace(problem, word, k)) continue;
    const bool moves = speeds(static_cast<Eigen::Index>(k)) > kPossible ||
                       word.result.segment<2>(problem.Row(k) + 1).norm() > still;
    if (!moves) return false;
  }
  return true;
}

Vector OnsetSpeeds(const FrictionProblem& problem, const FrictionSolution& word) {
  const Vector found = PossibleSpeeds(problem, word);
  Vector speeds = Vector::Zero(found.size());
  bool all = true;
  for (Eigen::Index k = 0; k < speeds.size(); ++k) {
    if (!BeginsInSpace(problem, word, static_cast<std::size_t>(k))) continue;
    speeds(k) = 1;
    all = all && found(k) > 0;
  }
  return all && speeds.any() ? Vector(found / found.maxCoeff()) : speeds;
}

Vector BegunMotion(const FrictionFrame& frame, const FrictionSolution& word, double speed) {
  const FrictionProblem& problem = frame.problem();
  const Onsets onsets = OnsetsOf(problem, word);
  if (!onsets.any) return {};
  const Matrix G = Matrix(problem.G(onsets.rows, onsets.rows));
  Matrix reach(frame.reach().rows(), G.cols());
  for (Eigen::Index r = 0; r < reach.cols(); ++r) {
    reach.col(r) = frame.reach().col(onsets.rows[static_cast<std::size_t>(r)]);
  }
  const Vector rates = onsets.rates * (speed * OnsetSpeeds(problem, word));
  return reach * G.completeOrthogonalDecomposition().solve(rates);
}

}  // namespace contact_flow
