// SPDX-License-Identifier: BSD-3-Clause
// Contacts of the reference simulator: complementarity, impacts, contact modes.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "test/adversary/reference_flow.h"

namespace contact_flow {
namespace adversary {
namespace {

constexpr double kDegenerate = 1e-7;  // forces and accelerations that may vanish, relative
constexpr double kPeek = 1e-4;        // [s] ahead, to decide these

}  // namespace

std::vector<int> Members(ConstraintSet set) {
  std::vector<int> members;
  for (int i : set) members.push_back(i);
  return members;
}

EnumeratedSolution EnumerateComplementarity(const Matrix& G, const Vector& b) {
  const int k = static_cast<int>(b.size());
  const double scale = std::max(1e-300, b.cwiseAbs().maxCoeff());
  EnumeratedSolution best;
  best.violation = std::numeric_limits<double>::infinity();
  for (unsigned support = 0; support < (1u << k); ++support) {
    std::vector<int> rows;
    for (int i = 0; i < k; ++i) {
      if (support >> i & 1) rows.push_back(i);
    }
    const int m = static_cast<int>(rows.size());
    Matrix part(m, m);
    Vector rhs(m);
    for (int i = 0; i < m; ++i) {
      rhs(i) = -b(rows[i]);
      for (int j = 0; j < m; ++j) part(i, j) = G(rows[i], rows[j]);
    }
    Vector z = Vector::Zero(k);
    if (m > 0) {
      const Vector solved = part.ldlt().solve(rhs);
      for (int i = 0; i < m; ++i) z(rows[i]) = solved(i);
    }
    const Vector w = G * z + b;
    double violation = 0, clearance = std::numeric_limits<double>::infinity();
    for (int i = 0; i < k; ++i) {
      const double value = (support >> i & 1) ? z(i) * G(i, i) : w(i);
      violation = std::max(violation, -value / scale);
      clearance = std::min(clearance, value / scale);
    }
    if (violation < best.violation) {
      best.violation = violation;
      best.clearance = clearance;
      best.support = support;
      best.z = z;
    }
  }
  return best;
}

void ReferenceFlow::PutInContact(Vector* x, ConstraintSet held) {
  if (held.Empty()) return;
  const int d = system_.dof();
  const std::vector<int> members = Members(held);
  const int k = static_cast<int>(members.size());
  Matrix A(k, d);
  for (int iteration = 0; iteration < 4; ++iteration) {
    system_.Constraints(x->head(d), x->tail(d), &terms_);
    Vector gap(k);
    for (int i = 0; i < k; ++i) {
      A.row(i) = terms_.jacobian.row(members[i]);
      gap(i) = terms_.gap(members[i]);
    }
    x->head(d) -= A.transpose() * (A * A.transpose()).ldlt().solve(gap);
  }
  x->tail(d) -= A.transpose() * (A * A.transpose()).ldlt().solve(A * x->tail(d));
}

/// (1b) over the constraints that touch; false when it has no solution.
bool ReferenceFlow::Impact(Vector* x, ConstraintSet touching) {
  const int d = system_.dof();
  dynamics_.Solve(*x, u_, ConstraintSet());
  system_.Constraints(x->head(d), x->tail(d), &terms_);
  const std::vector<int> members = Members(touching);
  const int k = static_cast<int>(members.size());
  Matrix A(k, d);
  Vector b(k);
  for (int i = 0; i < k; ++i) {
    A.row(i) = terms_.jacobian.row(members[i]);
    b(i) = (1 + system_.restitution()(members[i])) * A.row(i).dot(x->tail(d));
  }
  const Matrix Y = dynamics_.mass().llt().solve(A.transpose());
  const Matrix G = A * Y;
  if (options_.law == ImpactLaw::kProjection) {
    x->tail(d) -= Y * G.ldlt().solve(b);
    return true;
  }
  const EnumeratedSolution solution = EnumerateComplementarity(G, b);
  x->tail(d) += Y * solution.z;
  return solution.violation < 1e-9;
}

/// The contact mode among those that touch and rest; x is put exactly at rest in it.
ConstraintSet ReferenceFlow::Decide(Vector* x, ConstraintSet candidates, std::string* doubt) {
  if (candidates.Empty()) return {};
  const int d = system_.dof();
  const std::vector<int> members = Members(candidates);
  const int k = static_cast<int>(members.size());
  dynamics_.Solve(*x, u_, ConstraintSet());
  system_.Constraints(x->head(d), x->tail(d), &terms_);
  Matrix A(k, d);
  Vector b(k);
  for (int i = 0; i < k; ++i) {
    A.row(i) = terms_.jacobian.row(members[i]);
    b(i) = A.row(i).dot(dynamics_.acceleration()) + terms_.bias(members[i]);
  }
  const Matrix G = A * dynamics_.mass().llt().solve(A.transpose());
  const EnumeratedSolution solution = EnumerateComplementarity(G, b);
  const auto subset = [&](unsigned support) {
    ConstraintSet mode;
    for (int i = 0; i < k; ++i) {
      if (support >> i & 1) mode.Insert(members[i]);
    }
    return mode;
  };
  ConstraintSet mode = subset(solution.support);
  if (solution.violation > 1e-9) *doubt = "no contact mode fits";
  if (solution.clearance < kDegenerate) {
    // Several modes fit at this instant: the one that fits a little later, too.
    const double scale = std::max(1e-300, b.cwiseAbs().maxCoeff());
    const ConstraintSet kept = mode_;
    int found = 0;
    for (unsigned support = 0; support < (1u << k); ++support) {
      const ConstraintSet trial = subset(support);
      Vector later = *x;
      PutInContact(&later, trial);
      const Vector now = later;
      if (!Glide(&later, u_, trial, kPeek)) continue;
      const auto fits = [&](const Vector& y, double slack) {
        dynamics_.Solve(y, u_, trial);
        system_.Constraints(y.head(d), y.tail(d), &terms_);
        const Vector normal = terms_.jacobian * dynamics_.acceleration() + terms_.bias;
        for (int i = 0; i < k; ++i) {
          const bool member = support >> i & 1;
          const int row = members[i];
          const double value = member ? dynamics_.force()(row) * G(i, i) : normal(row);
          if (!(value >= -slack)) return false;
        }
        return true;
      };
      if (!fits(now, 10 * kDegenerate * scale) || !fits(later, 0)) continue;
      ++found;
      mode = trial;
    }
    mode_ = kept;
    if (found != 1) *doubt = "forces vanish at once and nothing decides";
  }
  PutInContact(x, mode);
  return mode;
}

ConstraintSet ReferenceFlow::InitialMode(const Vector& x, const Vector& u, std::string* doubt) {
  const int d = system_.dof();
  u_ = u;
  mode_ = ConstraintSet();
  system_.Constraints(x.head(d), x.tail(d), &terms_);
  const Vector rate = terms_.jacobian * x.tail(d);
  ConstraintSet candidates;
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (std::abs(terms_.gap(i)) <= 1e-11 && std::abs(rate(i)) <= 1e-9) candidates.Insert(i);
  }
  Vector copy = x;
  return Decide(&copy, candidates, doubt);
}

}  // namespace adversary
}  // namespace contact_flow
