// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "contact_flow/budget.h"
#include "search.h"

namespace contact_flow {
namespace {

/// Products with ∇²L are asked for this often at most.
constexpr int kMaxProducts = 8;
/// H counts with this part of its diagonal where it has less.
constexpr double kLeastCurvature = 1e-6;
/// Steps of quotients, by which L rises by half its square relative to 1 + L; and at most this part
/// of how far an unknown reaches.
constexpr double kQuotient = 1e-4;
/// Curvature above this part of −H is rounding of quotients.
constexpr double kNegative = -1e-3;
/// … and steps of Newton count with this part of H at least.
constexpr double kLeastNewton = 1e-3;
constexpr int kMaxTrustHalvings = 24;

/// An unknown is moved by what makes the cost rise by about itself, but not by many times what it
/// is; of one that is 0 curvature that would let it go this much further than others is rounding.
constexpr double kTimes = 10, kNoCurvature = 1e8;

/// How far each unknown can be moved before that is another problem, by its value and by what its
/// curvature suggests.
Vector ReachOf(const Vector& y, const Vector& by_curvature) {
  const double others = 1 + y.cwiseAbs().maxCoeff();
  Vector reach = y.cwiseAbs();
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const double most = reach(i) > 0                              ? kTimes * reach(i)
                        : by_curvature(i) > kNoCurvature * others ? others
                                                                  : by_curvature(i);
    reach(i) += std::min(by_curvature(i), most);
  }
  return reach;
}

/// Whether both have the same events in the same order.
bool SameOrder(const PieceModel& a, const PieceModel& b) {
  return a.label == b.label &&
         std::equal(a.times.begin(), a.times.end(), b.times.begin(), b.times.end(),
                    [](const EventTime& s, const EventTime& t) { return s.name == t.name; });
}

/// Σ z_r row_r with the multipliers of a step, whose rows are those of `at`.
Vector Forces(const PieceModel& at, const PieceModel& piece, const PieceStep& step) {
  Vector sum = Vector::Zero(piece.gradient.size());
  for (std::size_t r = 0; r < at.orders.size(); ++r) {
    const double z = step.multipliers(static_cast<Eigen::Index>(r));
    if (z == 0) continue;
    for (const OrderRow& row : piece.orders) {
      const bool same = row.first == at.orders[r].first && row.second == at.orders[r].second;
      if (same) sum += z * row.row.transpose();
    }
  }
  return sum;
}

}  // namespace

/// A point with less cost than a minimum of the first order, along a direction of negative
/// curvature of L, or, without one, of the step of Newton within the directions that were asked: H
/// may be much larger than ∇²L. False where there is none. By the method of Lanczos on C in
///   ∇²(L − Σ z (t_second − t_first)) = H + C
/// in the metric of H, along the faces and bounds that hold the minimum. Products are quotients.
bool Search::Escape(FacePoint* point) {
  const Vector y = best_.y;
  const PieceModels models = ModelsAt(y);
  if (!models.status.ok() || models.pieces.empty()) return false;
  const PieceModel& piece = models.pieces.front();
  const PieceStep step = StepsOf(models, y, 0).front();
  if (!step.solved) return false;
  // Free directions: N.
  const std::vector<int> active = Active(piece, step, false);
  const Vector &lower = unknowns_.lower(), &upper = unknowns_.upper();
  std::vector<bool> held(static_cast<std::size_t>(y.size()));
  std::vector<Eigen::Index> open;
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const bool at_bound = y(i) <= lower(i) || y(i) >= upper(i);
    held[at] = lower(i) == upper(i) || (at_bound && step.bounded[at]);
    if (!held[at]) open.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(open.size());
  Matrix N = Matrix::Zero(y.size(), count);
  for (Eigen::Index i = 0; i < count; ++i) N(open[static_cast<std::size_t>(i)], i) = 1;
  if (!active.empty() && count > 0) {
    Matrix rows(static_cast<Eigen::Index>(active.size()), y.size());
    for (std::size_t r = 0; r < active.size(); ++r) {
      rows.row(static_cast<Eigen::Index>(r)) =
          piece.orders[static_cast<std::size_t>(active[r])].row;
    }
    Eigen::ColPivHouseholderQR<Matrix> qr((rows * N).transpose());
    const Matrix Q = qr.householderQ();
    N = (N * Q.rightCols(count - qr.rank())).eval();
  }
  if (N.cols() == 0) return false;
  const Vector sizes = SizesOfCurvature(piece.hessian);
  Matrix H = piece.hessian;
  H.diagonal() += (piece.hessian.isZero(0) ? 1 : kLeastCurvature) * sizes;
  H = (N.transpose() * H * N).eval();
  const Vector reach =
      ReachOf(y, std::sqrt(1 + std::abs(models.cost)) * sizes.cwiseSqrt().cwiseInverse());
  const auto whole = [&](const Vector& d) {
    return 1 / d.cwiseQuotient(reach).cwiseAbs().maxCoeff();
  };
  const Eigen::LLT<Matrix> factor(H);
  if (factor.info() != Eigen::Success) return false;
  const auto direction = [&](const Vector& s) -> Vector { return N * factor.matrixU().solve(s); };
  const Vector force = piece.gradient - Forces(piece, piece, step);
  const Vector pull = factor.matrixL().solve(N.transpose() * force);
  /// (I + H^{-1/2} C H^{-1/2}) s; empty where the piece ends.
  const auto product = [&](const Vector& s) -> Vector {
    const Vector d = direction(s);
    const double h = kQuotient * std::min(std::sqrt(1 + std::abs(models.cost)), whole(d));
    const PieceModels beside = ModelsAt(Clamped(y + h * d));
    if (!beside.status.ok()) return {};
    for (const PieceModel& other : beside.pieces) {
      if (!SameOrder(piece, other)) continue;
      const Vector change = other.gradient - Forces(piece, other, step) - force;
      return factor.matrixL().solve(N.transpose() * change) / h;
    }
    return {};
  };
  // Lanczos, orthogonalized anew.
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Vector s = Vector::NullaryExpr(N.cols(), [&] { return normal(random); });
  s.normalize();
  const Eigen::Index most = std::min<Eigen::Index>(kMaxProducts, N.cols());
  Matrix basis(N.cols(), most), products(N.cols(), most);
  Vector lowest, inner;
  for (Eigen::Index k = 0; k < most; ++k) {
    AskBudget();
    basis.col(k) = s;
    const Vector next = product(s);
    if (next.size() == 0) break;
    products.col(k) = next;
    const auto known = basis.leftCols(k + 1);
    const Matrix projected = known.transpose() * products.leftCols(k + 1);
    const Eigen::SelfAdjointEigenSolver<Matrix> ritz(0.5 * (projected + projected.transpose()));
    if (ritz.eigenvalues()(0) < kNegative) lowest = known * ritz.eigenvectors().col(0);
    const Vector down = -ritz.eigenvectors().transpose() * (known.transpose() * pull);
    inner = known * ritz.eigenvectors() *
            (down.array() / ritz.eigenvalues().array().max(kLeastNewton)).matrix();
    s = next - known * (known.transpose() * next);
    s -= known * (known.transpose() * s).eval();
    if (!(s.norm() > kQuotient * next.norm())) break;
    s.normalize();
  }
  const double none = tolerance_ * (1 + std::abs(best_.cost));
  const bool negative = lowest.size() > 0;
  if (!negative && !(inner.size() > 0 && -0.5 * pull.dot(inner) > none)) return false;
  // Plain runs decide.
  Vector d = direction(negative ? lowest : inner);
  if (negative) d *= whole(d);
  FacePoint least = best_;
  for (double sign : {1.0, -1.0}) {
    if (!negative && sign < 0) break;
    double alpha = sign;
    for (int halving = 0; halving < kMaxTrustHalvings; ++halving, alpha /= 2) {
      const Vector to = Clamped(y + alpha * d);
      const FacePoint trial = active.empty() ? At(to)
                                             : PutOntoFace(unknowns_, multipliers_, piece, active,
                                                           held, to, &result_.simulations);
      if (!(trial.cost < least.cost - tolerance_ * (1 + std::abs(least.cost)))) continue;
      least = trial;
      if (!negative) break;
    }
  }
  if (!(least.cost < best_.cost)) return false;
  *point = least;
  return true;
}

}  // namespace contact_flow
