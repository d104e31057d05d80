// SPDX-License-Identifier: BSD-3-Clause
#include "cone_program.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "cone_polish.h"

namespace contact_flow {
namespace {

constexpr int kRounds = 60;
/// Of a step, for its equality constraints.
constexpr int kRefinements = 2;
/// A step goes this part of the way to the border.
constexpr double kStepPart = 0.99;
/// The gap of rounding, the one that has to be reached, and one to polish from, relative.
constexpr double kGap = 1e-15, kEnough = 1e-11, kClose = 1e-6;
constexpr double kUnbounded = 1e9;

/// Of one cone: W = η (… ), symmetric, with W y = W⁻¹ s = λ.
struct Scaling {
  double eta = 1;
  Vector w;       // of hyperbolic norm 1
  Vector lambda;  // scaled point
};

double Hyperbolic(const Vector& a) { return a(0) * a(0) - a.tail(a.size() - 1).squaredNorm(); }

/// W̄ u, or with a sign of −1 its inverse.
Vector Apply(const Scaling& scaling, const Vector& u, double sign) {
  const Vector& w = scaling.w;
  const Eigen::Index n = u.size() - 1;
  Vector out(n + 1);
  const double along = w.tail(n).dot(u.tail(n));
  out(0) = w(0) * u(0) + sign * along;
  out.tail(n) = u.tail(n) + (sign * u(0) + along / (1 + w(0))) * w.tail(n);
  return (sign > 0 ? scaling.eta : 1 / scaling.eta) * out;
}

Scaling Scale(const Vector& s, const Vector& y) {
  Scaling scaling;
  const Eigen::Index n = s.size() - 1;
  const double size_s = std::sqrt(Hyperbolic(s)), size_y = std::sqrt(Hyperbolic(y));
  const Vector a = s / size_s, b = y / size_y;
  const double gamma = std::sqrt(0.5 * (1 + a.dot(b)));
  scaling.w = a;
  scaling.w(0) += b(0);
  scaling.w.tail(n) -= b.tail(n);
  scaling.w /= 2 * gamma;
  scaling.eta = std::sqrt(size_s / size_y);
  scaling.lambda = Apply(scaling, y, 1);
  return scaling;
}

/// Jordan's product, and its inverse λ∘x = r.
Vector Product(const Vector& a, const Vector& b) {
  Vector out = a(0) * b + b(0) * a;
  out(0) = a.dot(b);
  return out;
}
Vector Divide(const Vector& lambda, const Vector& r) {
  const Eigen::Index n = r.size() - 1;
  Vector x(n + 1);
  x(0) = (lambda(0) * r(0) - lambda.tail(n).dot(r.tail(n))) / Hyperbolic(lambda);
  x.tail(n) = (r.tail(n) - x(0) * lambda.tail(n)) / lambda(0);
  return x;
}

/// How far a may go along d until it leaves the cone.
double Reach(const Vector& a, const Vector& d) {
  const Eigen::Index n = a.size() - 1;
  const double infinite = std::numeric_limits<double>::infinity();
  if (n == 0) return d(0) < 0 ? -a(0) / d(0) : infinite;
  const double qa = Hyperbolic(d), qb = a(0) * d(0) - a.tail(n).dot(d.tail(n)),
               qc = std::max(Hyperbolic(a), 0.0);
  const double discriminant = qb * qb - qa * qc;
  double reach = infinite;
  if (qa < 0 || (qb < 0 && discriminant >= 0)) {
    const double root = std::sqrt(std::max(discriminant, 0.0));
    // The positive root, without cancellation.
    reach = qb < 0 ? qc / (-qb + root) : (qb + root) / -qa;
  }
  if (d(0) < 0) reach = std::min(reach, -a(0) / d(0));
  return reach;
}

class Method {
 public:
  Method(const Vector& f, const Vector& c, const Matrix& B, const std::vector<int>& cones,
         const Vector& start)
      : f_(f), c_(c), B_(B), cones_(cones) {
    at_.z = start;
    at_.slack = c + B * start;
    at_.dual = Vector::Zero(c.size());
    for (int first = 0, k = 0; k < Count(); first += cones[Place(k)], ++k) at_.dual(first) = 1;
  }

  std::optional<ConeSolution> Solve() {
    const double size = 1 + c_.cwiseAbs().maxCoeff();
    double best = std::numeric_limits<double>::infinity();
    ConeSolution found;
    for (int round = 0; round < kRounds; ++round) {
      const double gap = at_.slack.dot(at_.dual);
      const Vector primal = c_ + B_ * at_.z - at_.slack, dual = f_ - B_.transpose() * at_.dual;
      const double error =
          std::max({gap, primal.cwiseAbs().maxCoeff(), dual.cwiseAbs().maxCoeff() * size});
      if (!std::isfinite(error)) break;
      if (error < best) {
        best = error;
        found = at_;
      }
      if (error <= kGap * size || at_.z.cwiseAbs().maxCoeff() > kUnbounded * size) break;
      if (!Step(gap, primal, dual)) break;
    }
    if (!(best <= kClose * size)) return std::nullopt;
    ConeSolution polished = found;
    if (PolishConeSolution(f_, c_, B_, cones_, &polished)) return polished;
    if (!(best <= kEnough * size)) return std::nullopt;
    return found;
  }

 private:
  int Count() const { return static_cast<int>(cones_.size()); }
  static std::size_t Place(int k) { return static_cast<std::size_t>(k); }

  template <class Function>
  void ForEach(const Function& function) const {
    for (int first = 0, k = 0; k < Count(); first += cones_[Place(k)], ++k) {
      function(Place(k), first, cones_[Place(k)]);
    }
  }

  bool Step(double gap, const Vector& primal, const Vector& dual) {
    std::vector<Scaling> scaling(cones_.size());
    bool inside = true;
    ForEach([&](std::size_t k, int first, int size) {
      const Vector s = at_.slack.segment(first, size), y = at_.dual.segment(first, size);
      inside = inside && Hyperbolic(s) > 0 && Hyperbolic(y) > 0;
      if (inside) scaling[k] = Scale(s, y);
    });
    if (!inside) return false;
    const auto scaled = [&](const Vector& u, double sign) {
      Vector out(u.size());
      ForEach([&](std::size_t k, int first, int size) {
        out.segment(first, size) = Apply(scaling[k], u.segment(first, size), sign);
      });
      return out;
    };
    Matrix columns(B_.rows(), B_.cols());  // W⁻¹ B
    for (Eigen::Index j = 0; j < B_.cols(); ++j) columns.col(j) = scaled(B_.col(j), -1);
    const Eigen::HouseholderQR<Matrix> factor(columns);
    const auto R = factor.matrixQR().topRows(B_.cols()).template triangularView<Eigen::Upper>();
    Vector change, change_s, change_y;  // of z, W⁻¹ s, W y
    const auto solve = [&](const Vector& rho, double part) {
      const Vector rest = rho - part * scaled(primal, -1);
      change = factor.solve(rest);
      const Vector down = R.transpose().solve(Vector(part * dual));
      change -= R.solve(down);
      change_s = columns * change + part * scaled(primal, -1);
      change_y = rho - change_s;
      // Near a solution whose columns are almost dependent Bᵀ y = f would be lost.
      for (int k = 0; k < kRefinements; ++k) {
        const Vector missing = part * dual - columns.transpose() * change_y;
        const Vector lower = R.transpose().solve(missing), more = R.solve(lower);
        change -= more;
        change_s -= columns * more;
        change_y = rho - change_s;
      }
    };
    const auto reach = [&] {
      double length = 1 / kStepPart;
      ForEach([&](std::size_t k, int first, int size) {
        length = std::min({length, Reach(scaling[k].lambda, change_s.segment(first, size)),
                           Reach(scaling[k].lambda, change_y.segment(first, size))});
      });
      return length;
    };
    Vector rho(c_.size());
    ForEach(
        [&](std::size_t k, int first, int size) { rho.segment(first, size) = -scaling[k].lambda; });
    solve(rho, 1);
    const double ahead = std::min(1.0, reach());
    const double centre = std::pow(1 - ahead, 3);
    const double mu = gap / Count();
    ForEach([&](std::size_t k, int first, int size) {
      Vector r = -Product(scaling[k].lambda, scaling[k].lambda) -
                 Product(change_s.segment(first, size), change_y.segment(first, size));
      r(0) += centre * mu;
      rho.segment(first, size) = Divide(scaling[k].lambda, r);
    });
    solve(rho, 1 - centre);
    const double length = std::min(1.0, kStepPart * reach());
    if (!(length > 1e-8) || !change.allFinite()) return false;
    at_.z += length * change;
    at_.slack = c_ + B_ * at_.z;
    at_.dual += length * scaled(change_y, -1);
    return true;
  }

  const Vector& f_;
  const Vector& c_;
  const Matrix& B_;
  const std::vector<int>& cones_;
  ConeSolution at_;
};

}  // namespace

std::optional<ConeSolution> SolveConeProgram(const Vector& f, const Vector& c, const Matrix& B,
                                             const std::vector<int>& cones, const Vector& start) {
  return Method(f, c, B, cones, start).Solve();
}

}  // namespace contact_flow
