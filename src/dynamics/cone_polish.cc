// SPDX-License-Identifier: BSD-3-Clause
#include "cone_polish.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace contact_flow {
namespace {

/// A part of a solution that is this small beside the largest vanishes.
constexpr double kVanishes[] = {1e-4, 1e-3, 1e-2, 1e-5};
constexpr int kPolishRounds = 8;
/// What is left of the equations, and how far outside its cone a part may be, relative.
constexpr double kSolved = 1e-14, kAccepted = 1e-12, kOutside = 1e-11;
/// Equations are dependent below this pivot, relative.
constexpr double kDependentCone = 1e-6;

/// Where z is not unique, that of an inner point is kept if the values agree, relative.
constexpr double kSameValue = 1e-6;

enum class Part { kNoDual, kNoSlack, kBoth };

/// How far inside its cone a vector is.
double Depth(const Vector& a) { return a(0) - a.tail(a.size() - 1).norm(); }

bool Polish(const Vector& f, const Vector& c, const Matrix& B, const std::vector<int>& cones,
            double vanishes, ConeSolution* solution) {
  const Eigen::Index m = c.size(), nz = B.cols();
  const double size = 1 + c.cwiseAbs().maxCoeff();
  double largest_slack = 0, largest_dual = 0;
  int first = 0;
  for (const int k : cones) {
    largest_slack = std::max(largest_slack, solution->slack.segment(first, k).norm());
    largest_dual = std::max(largest_dual, solution->dual.segment(first, k).norm());
    first += k;
  }
  if (!(largest_slack > 0) || !(largest_dual > 0)) return false;
  std::vector<Part> parts;
  Eigen::Index both = 0;
  first = 0;
  for (const int k : cones) {
    const double s = solution->slack.segment(first, k).norm() / largest_slack;
    const double y = solution->dual.segment(first, k).norm() / largest_dual;
    first += k;
    const bool one = k == 1 || std::min(s, y) < vanishes;
    parts.push_back(!one ? Part::kBoth : y < s ? Part::kNoDual : Part::kNoSlack);
    if (!one) ++both;
  }
  Vector z = solution->z, y = solution->dual, nu(both);
  first = 0;
  for (std::size_t i = 0, at = 0; i < cones.size(); first += cones[i++]) {
    if (parts[i] == Part::kNoDual) y.segment(first, cones[i]).setZero();
    if (parts[i] != Part::kBoth) continue;
    nu(static_cast<Eigen::Index>(at++)) = solution->slack(first) / y(first);
  }
  // Unknowns (z, y, ν); equations Bᵀ y = f, one block for each cone, and |w| = r.
  const Eigen::Index unknowns = nz + m + both, equations = nz + m + both;
  Matrix jacobian(equations, unknowns);
  Vector residual(equations);
  double left = 0;
  for (int round = 0; round <= kPolishRounds; ++round) {
    jacobian.setZero();
    residual.head(nz) = B.transpose() * y - f;
    jacobian.block(0, nz, nz, m) = B.transpose();
    const Vector slack = c + B * z;
    first = 0;
    for (std::size_t i = 0, at = 0; i < cones.size(); first += cones[i++]) {
      const int k = cones[i];
      const Eigen::Index row = nz + first;
      if (parts[i] == Part::kNoDual) {
        residual.segment(row, k) = y.segment(first, k);
        jacobian.block(row, nz + first, k, k).setIdentity();
        continue;
      }
      residual.segment(row, k) = slack.segment(first, k);
      jacobian.block(row, 0, k, nz) = B.middleRows(first, k);
      if (parts[i] == Part::kNoSlack) continue;
      const auto place = static_cast<Eigen::Index>(at++);
      Vector mirrored = -y.segment(first, k);
      mirrored(0) = y(first);
      residual.segment(row, k) -= nu(place) * mirrored;
      jacobian.block(row, nz + first, k, k).diagonal().setConstant(nu(place));
      jacobian(row, nz + first) = -nu(place);
      jacobian.block(row, nz + m + place, k, 1) = -mirrored;
      residual(nz + m + place) = 0.5 * mirrored.dot(y.segment(first, k));
      jacobian.block(nz + m + place, nz + first, 1, k) = mirrored.transpose();
    }
    left = residual.cwiseAbs().maxCoeff();
    if (!std::isfinite(left)) return false;
    if (left <= kSolved * size || round == kPolishRounds) break;
    Eigen::CompleteOrthogonalDecomposition<Matrix> factor;
    factor.setThreshold(kDependentCone);
    factor.compute(jacobian);
    const Vector change = factor.solve(residual);
    z -= change.head(nz);
    y -= change.segment(nz, m);
    nu -= change.tail(both);
  }
  if (!(left <= kAccepted * size)) return false;
  const Vector slack = c + B * z;
  bool inside = true;
  first = 0;
  for (const int k : cones) {
    inside = inside && Depth(slack.segment(first, k)) >= -kOutside * size;
    if (!(Depth(y.segment(first, k)) >= -kOutside * largest_dual)) return false;
    first += k;
  }
  if (inside) {
    solution->z = z;
    solution->slack = slack;
  } else if (!(std::abs(c.dot(y - solution->dual)) <= kSameValue * size)) {
    return false;
  }
  solution->dual = y;
  return true;
}

}  // namespace

bool PolishConeSolution(const Vector& f, const Vector& c, const Matrix& B,
                        const std::vector<int>& cones, ConeSolution* solution) {
  for (const double vanishes : kVanishes) {
    if (Polish(f, c, B, cones, vanishes, solution)) return true;
  }
  return false;
}

}  // namespace contact_flow
