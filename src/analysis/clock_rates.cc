// SPDX-License-Identifier: BSD-3-Clause
#include "clock_rates.h"

#include <algorithm>

#include "contact_flow/budget.h"
#include "contact_flow/model/driven.h"
#include "contact_flow/piecewise_linear/section.h"

namespace contact_flow {
namespace {

constexpr int kParts = 4;  // of an arc, at whose ends it is looked at

/// What acts on velocities at a state, and what depends on their coordinates.
class Rates {
 public:
  Rates(const MechanicalSystem& system, const VectorRef& u) : system_(system), u_(u) {}

  void Look(const VectorRef& x, ContactMode mode) {
    const int d = system_.dof(), nq = system_.num_positions();
    const VectorRef q = x.head(nq), v = x.tail(d);
    v_ = v;
    system_.Dynamics(q, v, u_, mode, &mass_, &force_);
    system_.DifferentiateDynamics(q, v, u_, mode, Vector::Ones(d), Vector::Zero(system_.num_rows()),
                                  &jacobian_);
    system_.Constraints(q, v, &terms_);
  }

  /// Whether nothing changes velocity j, as far as (q, v) tells.
  bool IsSteady(int j) const {
    if (v_(j) == 0) return false;
    if (IsDriven(j)) return true;
    Vector row = mass_.row(j);
    row(j) = 0;
    return row.isZero(0) && force_(j) == 0 && jacobian_.momentum_q.row(j).isZero(0) &&
           jacobian_.momentum_v.row(j).isZero(0) && jacobian_.momentum_u.row(j).isZero(0) &&
           !Constrains(j, false);
  }
  bool Counts(int j) const {
    return IsDriven(j) || !jacobian_.momentum_q.col(j).isZero(0) || Constrains(j, true);
  }

 private:
  bool IsDriven(int j) const { return mass_(j, j) == kDrivenInertia; }

  /// Whether a constraint that is compliant, or one that is not, has coordinate j.
  bool Constrains(int j, bool compliant) const {
    for (Eigen::Index row = 0; row < terms_.jacobian.rows(); ++row) {
      const bool yields =
          row < system_.num_constraints() && system_.compliant().Contains(static_cast<int>(row));
      if (yields == compliant && terms_.jacobian(row, j) != 0) return true;
    }
    return false;
  }

  const MechanicalSystem& system_;
  const Vector u_;
  Vector v_, force_;
  Matrix mass_;
  ResidualJacobian jacobian_;
  ConstraintTerms terms_;
};

}  // namespace

std::vector<int> ClockRates(const MechanicalSystem& system, const Trajectory& run) {
  std::vector<int> steady;
  std::vector<bool> counts(static_cast<std::size_t>(system.dof()), false);
  for (int j = 0; j < system.dof(); ++j) steady.push_back(j);
  for (const Arc& arc : run.arcs) {
    Rates rates(system, arc.u);
    const int parts = arc.dense.Empty() ? 1 : kParts;
    for (int part = 0; part <= parts; ++part) {
      if (steady.empty()) return steady;
      AskBudget();
      Vector x = part == 0 ? arc.x_begin : arc.x_end;
      if (part > 0 && part < parts) {
        arc.dense.Evaluate(arc.t_begin + (arc.t_end - arc.t_begin) * part / parts, x.data());
      }
      rates.Look(x, arc.mode);
      const auto changes = [&](int j) { return !rates.IsSteady(j); };
      steady.erase(std::remove_if(steady.begin(), steady.end(), changes), steady.end());
      for (int j : steady) {
        const auto place = static_cast<std::size_t>(j);
        counts[place] = counts[place] || rates.Counts(j);
      }
    }
  }
  const auto idle = [&](int j) { return !counts[static_cast<std::size_t>(j)]; };
  steady.erase(std::remove_if(steady.begin(), steady.end(), idle), steady.end());
  return steady;
}

Matrix RateRows(const std::vector<int>& velocities, int dof) {
  Matrix rows = Matrix::Zero(static_cast<Eigen::Index>(velocities.size()), 2 * dof);
  for (std::size_t k = 0; k < velocities.size(); ++k) {
    rows(static_cast<Eigen::Index>(k), dof + velocities[k]) = 1;
  }
  return rows;
}

Matrix Keeping(const Matrix& basis, const Matrix& rows) {
  if (rows.rows() == 0 || basis.cols() == 0) return basis;
  const Eigen::Index n = basis.rows();
  Matrix left(n + rows.rows(), n);
  left.topRows(n) = Matrix::Identity(n, n) - basis * basis.transpose();
  left.bottomRows(rows.rows()) = rows;
  return NullSpace(left);
}

}  // namespace contact_flow
