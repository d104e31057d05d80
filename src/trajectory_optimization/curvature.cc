// SPDX-License-Identifier: BSD-3-Clause
#include "curvature.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "contact_flow/budget.h"
#include "piece_step.h"

namespace contact_flow {
namespace {

/// Changes of the gradient below this part of it are not compared: tangents are right to 1e-11.
constexpr double kNoise = 1e-7;
/// Secants need a curvature of more than this, relative to the lengths of both changes beside the
/// diagonal of H.
constexpr double kLeastSecant = 1e-6;
/// Pivots below this part of their diagonal entries are none.
constexpr double kSingular = 1e-12;

/// H + C that is not positive definite is lifted by this part of the diagonal of H, and by ten
/// times more in turn.
constexpr double kFirstLift = 1e-3;
constexpr int kMaxLifts = 7;

/// Whether a step and the change of the gradient along it tell of curvature, by each √H_ii.
bool IsSecant(const Vector& s, const Vector& change, const Vector& roots) {
  const double lengths = s.cwiseProduct(roots).norm() * change.cwiseQuotient(roots).norm();
  return change.dot(s) > kLeastSecant * lengths;
}

bool IsPositive(const Matrix& H) {
  const Eigen::LLT<Matrix> factor(H);
  if (factor.info() != Eigen::Success) return false;
  const auto pivots = factor.matrixLLT().diagonal().array().square();
  return (pivots > kSingular * H.diagonal().array()).all();
}

std::vector<EventName> OrderOf(const PieceModel& piece) {
  std::vector<EventName> order;
  for (const EventTime& event : piece.times) order.push_back(event.name);
  return order;
}

/// Σ z_r (row_r − what it was), for rows that are known.
Vector TurnOfRows(const std::vector<OrderRow>& before, const PieceModel& piece, const Vector& z) {
  const std::vector<OrderRow>& now = piece.orders;
  Vector sum = Vector::Zero(piece.gradient.size());
  for (std::size_t r = 0; r < now.size(); ++r) {
    const double weight = z(static_cast<Eigen::Index>(r));
    if (weight == 0) continue;
    for (const OrderRow& other : before) {
      const bool same = other.first == now[r].first && other.second == now[r].second;
      if (same) sum += weight * (now[r].row - other.row).transpose();
    }
  }
  return sum;
}

}  // namespace

void Curvature::Learn(const Vector& y, const PieceModels& models,
                      const std::vector<Vector>& multipliers) {
  std::vector<Seen> seen;
  bool learnt = false;
  for (const PieceModel& piece : models.pieces) {
    seen.push_back({OrderOf(piece), piece.gradient, piece.orders});
    if (learnt) continue;
    const auto before = std::find_if(seen_.begin(), seen_.end(), [&](const Seen& other) {
      return other.order == seen.back().order;
    });
    if (before == seen_.end()) continue;
    const Vector s = y - y_, change = piece.gradient - before->gradient;
    Update(s, change, piece.hessian);
    if (whole_.size() == 0) whole_ = piece.hessian;
    UpdateWhole(s, change - TurnOfRows(before->rows, piece, multipliers[seen.size() - 1]));
    learnt = true;
  }
  if (!learnt) whole_.resize(0, 0);
  seen_ = std::move(seen);
  y_ = y;
}

void Curvature::Update(const Vector& s, const Vector& change, const Matrix& hessian) {
  const double secant = change.dot(s);
  const Vector roots = SizesOfCurvature(hessian).cwiseSqrt();
  const auto largest = [&](const Vector& g) {
    return g.cwiseQuotient(roots).cwiseAbs().maxCoeff();
  };
  if (!IsSecant(s, change, roots)) return;
  const Vector left = change - hessian * s;  // what C s should be
  if (!(largest(left) > kNoise * (largest(hessian * s) + largest(change)))) return;
  if (rest_.size() == 0) rest_ = Matrix::Zero(s.size(), s.size());
  const double now = s.dot(rest_ * s);
  if (now != 0) rest_ *= std::min(1.0, std::abs(s.dot(left) / now));
  const Vector off = left - rest_ * s;
  rest_ += (off * change.transpose() + change * off.transpose()) / secant -
           off.dot(s) / (secant * secant) * change * change.transpose();
}

void Curvature::UpdateWhole(const Vector& s, const Vector& change) {
  const double secant = change.dot(s);
  const Vector known = whole_ * s;
  const double now = s.dot(known);
  if (!IsSecant(s, change, SizesOfCurvature(whole_).cwiseSqrt()) || !(now > 0)) return;
  whole_ += change * change.transpose() / secant - known * known.transpose() / now;
}

bool Curvature::Replace(PieceModels* models) const {
  if (whole_.size() == 0) return false;
  for (PieceModel& piece : models->pieces) piece.hessian = whole_;
  return true;
}

bool Curvature::Add(PieceModels* models) const {
  if (rest_.size() == 0) return false;
  double lift = 0;  // the same for all pieces
  for (PieceModel& piece : models->pieces) {
    const Vector sizes = SizesOfCurvature(piece.hessian);
    piece.hessian += rest_;
    piece.hessian.diagonal() += lift * sizes;
    for (int tries = 0; !IsPositive(piece.hessian); ++tries) {
      AskBudget();
      if (tries == kMaxLifts) return false;
      const double more = lift > 0 ? 9 * lift : kFirstLift;
      piece.hessian.diagonal() += more * sizes;
      lift += more;
    }
  }
  return true;
}

}  // namespace contact_flow
