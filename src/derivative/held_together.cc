// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/held_together.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/derivative/variation.h"
#include "contact_flow/model/row_layout.h"
#include "frictional_reset.h"
#include "src/dynamics/dependent_rows.h"

namespace contact_flow {
namespace {

/// What a direction moves apart by less than this is rounding, or an error of its tangents,
/// relative to the terms of the rates.
constexpr double kTogether = 1e-6;
/// Entries of tangents that are rounding, relative to the largest.
constexpr double kNoTangent = 1e-7;
/// Entries of combinations that are rounding, relative: by velocities rows are dependent to this.
constexpr double kNoEntry = 1e-9, kNoHeldVelocity = 1e-5;
/// Speeds that are rounding, or what contacts drift by, relative to the largest; to the error of
/// the arc; and to those that forces would give the bodies along it without contacts.
constexpr double kNoSpeed = 1e-7, kDrifts = 10, kRoundingOfSpeed = 1e-13;

/// The rows whose rates are held at zero in a mode.
std::vector<int> AtRest(const MechanicalSystem& system, ContactMode mode) {
  const RowLayout layout(system);
  std::vector<int> rows = layout.Closed(mode - system.compliant());
  if (system.HasFriction()) layout.AddTangential(mode.Sticking() - system.compliant(), &rows);
  return rows;
}

/// Combinations Z of rows that are none, Zᵀ A = 0.
RowBasis BasisOf(const Matrix& A, const Matrix& mass) {
  const Matrix G = A * mass.llt().solve(A.transpose());
  if (!G.allFinite() || !(G.diagonal().array() > 0).all()) {
    return {{}, {}, Matrix(A.rows(), 0)};
  }
  return FindRowBasis(G);
}

Matrix RowsOf(const Matrix& all, const std::vector<int>& rows) {
  Matrix chosen(static_cast<Eigen::Index>(rows.size()), all.cols());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    chosen.row(static_cast<Eigen::Index>(r)) = all.row(rows[r]);
  }
  return chosen;
}

/// Gradients of all gaps, by (δq, δv, δu, δp).
Matrix GapJacobian(const ContactDynamics& dynamics, const Vector& x) {
  const MechanicalSystem& system = dynamics.system();
  const int d = system.dof(), nq = system.num_positions(), rows = system.num_rows();
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  Matrix jacobian = Matrix::Zero(terms.gap.size(), 2 * d + dynamics.num_variables());
  jacobian.leftCols(d) = terms.jacobian.topRows(terms.gap.size());
  const std::vector<int>& parameters = dynamics.variables().parameters;
  if (parameters.empty()) return jacobian;
  ParameterJacobian by_parameter;
  system.DifferentiateImpactByParameters(x.head(nq), Vector::Zero(d), Vector::Zero(rows), x.tail(d),
                                         parameters, &by_parameter);
  jacobian.rightCols(by_parameter.gap.cols()) = by_parameter.gap.topRows(terms.gap.size());
  return jacobian;
}

Matrix MassAt(const ContactDynamics& dynamics, const Vector& x, ContactMode mode) {
  const MechanicalSystem& system = dynamics.system();
  Matrix mass;
  Vector applied;
  system.Dynamics(x.head(system.num_positions()), x.tail(system.dof()), dynamics.u(), mode, &mass,
                  &applied);
  return mass;
}

Arc Between(const Arc& arc, double begin, double end) {
  Arc slice = arc;
  slice.dense = arc.dense.Between(begin, end);
  slice.t_begin = begin;
  slice.t_end = end;
  slice.dense.Evaluate(begin, slice.x_begin.data());
  slice.dense.Evaluate(end, slice.x_end.data());
  return slice;
}

/// The tangents that keep what is held, as far as its rows are independent: a projector.
Matrix Kept(const ContactDynamics& dynamics, const Vector& x, ContactMode mode) {
  const MechanicalSystem& system = dynamics.system();
  const int d = system.dof();
  const std::vector<int> closed = RowLayout(system).Closed(mode - system.compliant());
  const std::vector<int> held = AtRest(system, mode);
  const Matrix rates = RowsOf(RateJacobian(dynamics, x), held);
  const Matrix mass = MassAt(dynamics, x, mode);
  const Matrix gaps = RowsOf(GapJacobian(dynamics, x), closed);
  const auto independent = [&](const Matrix& rows, Eigen::Index first) {
    const RowBasis basis = BasisOf(rows.middleCols(first, d), mass);
    return basis.inverse.size() > 0 ? RowsOf(rows, basis.rows) : rows;
  };
  const Matrix a = independent(gaps, 0), b = independent(rates, d);
  Matrix all(a.rows() + b.rows(), a.cols());
  all << a, b;
  for (Eigen::Index r = 0; r < all.rows(); ++r) {
    if (all.row(r).norm() > 0) all.row(r).normalize();
  }
  return Matrix::Identity(all.cols(), all.cols()) -
         all.completeOrthogonalDecomposition().solve(all);
}

}  // namespace

HeldTogether::Instant HeldTogether::At(ContactDynamics* dynamics, const Vector& x, ContactMode mode,
                                       double t, double least) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof();
  Instant instant;
  instant.t = t;
  const std::vector<int> closed = RowLayout(system).Closed(mode - system.compliant());
  const std::vector<int> held = AtRest(system, mode);
  const Matrix mass = MassAt(*dynamics, x, mode);
  std::vector<Eigen::RowVectorXd> rows, terms;
  // Rates at velocities that are rounding.
  Vector slow = x;
  const double speed = std::max(least, kNoSpeed * x.tail(d).cwiseAbs().maxCoeff());
  for (int j = 0; j < d; ++j) slow(system.num_positions() + j) = speed * (1 + 0.3 * std::sin(j));
  const auto add = [&](const std::vector<int>& of, const Matrix& gradients, int first,
                       const Matrix& rounding) {
    const Matrix Z = BasisOf(gradients.middleCols(first, d), mass).freedom;
    for (Eigen::Index j = 0; j < Z.cols(); ++j) {
      Eigen::RowVectorXd row = Z.col(j).transpose() * gradients;
      const Eigen::RowVectorXd sum = Z.col(j).cwiseAbs().transpose() * gradients.cwiseAbs();
      const Eigen::RowVectorXd slowest = Z.col(j).cwiseAbs().transpose() * rounding.cwiseAbs();
      for (Eigen::Index c = 0; c < row.size(); ++c) {
        const bool keeps = c >= first && c < first + d;
        const double noise = keeps ? kNoHeldVelocity * sum(c) : kNoEntry * sum(c) + slowest(c);
        if (std::abs(row(c)) <= noise) row(c) = 0;
      }
      if (row.isZero(0)) continue;
      ConstraintSet sharing;
      for (std::size_t r = 0; r < of.size(); ++r) {
        if (Z(static_cast<Eigen::Index>(r), j) == 0) continue;
        for (int i : mode - system.compliant()) {
          const bool tangential = system.HasFriction() && of[r] >= system.friction()[i].row &&
                                  of[r] < system.friction()[i].row + system.friction()[i].dimension;
          if (of[r] == i || tangential) sharing.Insert(i);
        }
      }
      rows.push_back(row);
      terms.push_back(sum);
      instant.sharing.push_back(sharing.ToString(system.description().constraints));
    }
  };
  if (closed.size() > 1) {
    const Matrix gaps = RowsOf(GapJacobian(*dynamics, x), closed);
    add(closed, gaps, 0, Matrix::Zero(gaps.rows(), gaps.cols()));
  }
  if (held.size() > 1) {
    add(held, RowsOf(RateJacobian(*dynamics, x), held), d,
        RowsOf(RateJacobian(*dynamics, slow), held));
  }
  instant.rows.resize(static_cast<Eigen::Index>(rows.size()), 2 * d + dynamics->num_variables());
  instant.terms.resizeLike(instant.rows);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    instant.rows.row(static_cast<Eigen::Index>(r)) = rows[r];
    instant.terms.row(static_cast<Eigen::Index>(r)) = terms[r];
  }
  return instant;
}

HeldTogether::HeldTogether(ContactDynamics* dynamics, const Arc& arc, double tolerance, int parts) {
  const MechanicalSystem& system = dynamics->system();
  if (!system.HasFriction() || (arc.mode - system.compliant()).Empty()) return;
  if (arc.t_end == arc.t_begin || arc.dense.Empty()) parts = 0;
  dynamics->Evaluate(arc.x_begin, ContactMode());
  double least =
      kRoundingOfSpeed * (arc.t_end - arc.t_begin) * dynamics->acceleration().cwiseAbs().maxCoeff();
  if (arc.error.size() > 0) {
    least = std::max(least, kDrifts * arc.error.tail(system.dof()).maxCoeff());
  }
  std::vector<Instant> all = {At(dynamics, arc.x_begin, arc.mode, arc.t_begin, least)};
  Vector x = arc.x_begin;
  for (int part = 1; part <= parts; ++part) {
    const double t =
        part == parts ? arc.t_end : arc.t_begin + part * (arc.t_end - arc.t_begin) / parts;
    arc.dense.Evaluate(t, x.data());
    all.push_back(At(dynamics, part == parts ? arc.x_end : x, arc.mode, t, least));
  }
  const auto asks = [](const Instant& instant) { return instant.rows.rows() > 0; };
  if (std::none_of(all.begin(), all.end(), asks)) return;
  const Eigen::Index size = 2 * system.dof() + dynamics->num_variables();
  Matrix phi = Matrix::Identity(size, size);
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (k > 0) phi = PropagateArc(dynamics, Between(arc, all[k - 1].t, all[k].t), tolerance) * phi;
    if (!asks(all[k])) continue;
    all[k].phi = phi;
    instants_.push_back(std::move(all[k]));
  }
  Judge(Kept(*dynamics, arc.x_begin, arc.mode));
}

std::string HeldTogether::Sentence(double t, const std::string& contacts) {
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << t << " s contacts " << contacts
          << " are held on rows that depend on each other";
  return message.str();
}

void HeldTogether::Judge(const Matrix& kept) {
  for (const Instant& instant : instants_) {
    const Matrix moved = instant.rows * (instant.phi * kept);
    const Matrix terms = instant.terms * (instant.phi.cwiseAbs() * kept.cwiseAbs());
    for (Eigen::Index r = 0; r < moved.rows(); ++r) {
      if ((moved.row(r).array().abs() <= kTogether * terms.row(r).array()).all()) continue;
      whole_ = {Outcome::kNotPiecewiseLinear,
                Sentence(instant.t, instant.sharing[static_cast<std::size_t>(r)]) +
                    ", and some directions move them apart: what follows along these is not known"};
      return;
    }
  }
}

void HeldTogether::Require(const VectorRef& w) const {
  for (const Instant& instant : instants_) {
    const Vector tangent = instant.phi * w;
    const Vector moved = instant.rows * tangent, terms = instant.terms * tangent.cwiseAbs();
    const double noise = kNoTangent * tangent.cwiseAbs().maxCoeff();
    for (Eigen::Index r = 0; r < moved.size(); ++r) {
      const double rounding = noise * instant.rows.row(r).cwiseAbs().maxCoeff();
      if (std::abs(moved(r)) <= std::max(kTogether * terms(r), rounding)) continue;
      throw std::domain_error(Sentence(instant.t, instant.sharing[static_cast<std::size_t>(r)]) +
                              ", and the direction moves them apart: no velocity holds all of "
                              "them, and which one slips or lets go is not followed");
    }
  }
}

}  // namespace contact_flow
