// SPDX-License-Identifier: BSD-3-Clause
#include "propagator_change.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "contact_flow/fixed_size.h"
#include "src/dynamics/slips_in_space.h"

namespace contact_flow {
namespace {

/// Second derivatives of the field are taken once in so many steps of an arc, about so often.
constexpr std::size_t kStepsOfPart = 8, kMostParts = 8;
/// Distance of the quotients of Jacobians: so many times the error, no further than this part of
/// 1 + |x|, nor than this part of a slip in space, beside which they are not linear, unless the
/// error itself is more, but at most kMostOfSlip of it.
constexpr double kMagnified = 1e4, kStep = 1e-5, kPartOfSlip = 0.1, kMostOfSlip = 0.5;
/// Decays by less than e^-kFast in the length of a piece count as none.
constexpr double kFast = 10;

/// The contacts that slip in space along an arc.
class FollowedSlips {
 public:
  FollowedSlips(ContactDynamics* dynamics, ContactMode mode) : dynamics_(*dynamics), mode_(mode) {
    const MechanicalSystem& system = dynamics->system();
    for (int i : SlipsInSpace(system, mode) - system.compliant()) {
      rows_.push_back(system.friction()[i].row);
    }
  }

  bool Empty() const { return rows_.empty(); }

  /// About what is left of tangents [2d × 2d] at x where they decay for a time T:
  /// (I − T DF / kFast)⁻¹, 1/(1 + r T/kFast) of what decays at the rate r.
  Matrix Left(const Vector& x, double T) const {
    const int d = dynamics_.system().dof();
    dynamics_.Differentiate(x, mode_);
    Matrix left = Matrix::Identity(2 * d, 2 * d);
    left.topRightCorner(d, d).diagonal().array() -= T / kFast;
    left.bottomRows(d) -= T / kFast * dynamics_.acceleration_jacobian().leftCols(2 * d);
    return left.partialPivLu().inverse();
  }

  /// Takes from the error e [2d] at x what would turn a slip round: a slip that is wrong by as much
  /// begins or ends at another instant, which is for the events to tell. Returns the largest
  /// multiple of what remains by which no slip changes by more than its part, at least 1.
  double KeepDirections(const Vector& x, Vector* e) const {
    const MechanicalSystem& system = dynamics_.system();
    const int d = system.dof();
    Matrix mass;
    Vector force;
    system.Dynamics(x.head(system.num_positions()), x.tail(d), dynamics_.u(), mode_, &mass, &force);
    const Eigen::LDLT<Matrix> inertia(mass);
    const Matrix rows = Rows(x);
    double reach = kMagnified;
    for (Eigen::Index row = 0; row < rows.rows(); row += 2) {
      const auto T = rows.middleRows<2>(row);
      const Eigen::Vector2d slip = T * x.tail(d);
      const Vector there = system.Perturb(x, *e);
      const Eigen::Vector2d change = Rows(there).middleRows<2>(row) * there.tail(d) - slip;
      const double part = slip.norm() / change.norm(), kept = part / kMostOfSlip;
      reach = std::min(reach, kPartOfSlip * part);
      if (!(kept < 1)) continue;
      const Matrix pushes = inertia.solve(T.transpose());
      const Eigen::Matrix2d mobility = T * pushes;
      e->tail(d) -= (1 - kept) * pushes * mobility.inverse() * change;
    }
    return std::max(1.0, reach);
  }

 private:
  /// T of the slips, two rows each [· × d].
  Matrix Rows(const Vector& x) const {
    const MechanicalSystem& system = dynamics_.system();
    const int d = system.dof();
    ConstraintTerms terms;
    system.Constraints(x.head(system.num_positions()), x.tail(d), &terms);
    Matrix rows(2 * static_cast<Eigen::Index>(rows_.size()), d);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      rows.middleRows<2>(2 * static_cast<Eigen::Index>(k)) = terms.jacobian.middleRows<2>(rows_[k]);
    }
    return rows;
  }

  ContactDynamics& dynamics_;
  const ContactMode mode_;
  std::vector<int> rows_;
};

/// [d × 2d+k] the change of the accelerations' Jacobian between x and x ⊞ e, by a quotient over
/// `step` times that.
Matrix JacobianChange(ContactDynamics* dynamics, const Vector& x, ContactMode mode, const Vector& e,
                      double step) {
  dynamics->Differentiate(x, mode);
  Matrix change = -dynamics->acceleration_jacobian();
  dynamics->Differentiate(dynamics->system().Perturb(x, step * e), mode);
  change += dynamics->acceleration_jacobian();
  return change / step;
}

/// The changes of an arc's propagator.
class ChangeOfArc {
 public:
  ChangeOfArc(ContactDynamics* dynamics, const Arc& arc)
      : dynamics_(*dynamics),
        arc_(arc),
        d_(dynamics->system().dof()),
        slips_(dynamics, arc.mode),
        x_(arc.x_begin) {}

  /// Of one part, by at most `most` pieces.
  Matrix OfPart(const ArcPart& part, std::size_t most, const Vector& e) {
    Matrix change = Matrix::Zero(2 * d_, part.phi.cols());
    const double size = e.cwiseAbs().maxCoeff();
    if (!(part.t_end > part.t_begin) || !(size > 0) || !std::isfinite(size)) return change;
    const DenseArc& dense = arc_.dense;
    std::size_t from = 0, to = dense.NumSteps();  // the steps that begin in it, and that before
    while (from + 1 < to && dense.StepBegin(from + 1) <= part.t_begin) ++from;
    while (to > from + 1 && dense.StepBegin(to - 1) >= part.t_end) --to;
    const std::size_t steps = to - from;
    const std::size_t pieces = std::clamp<std::size_t>(steps / kStepsOfPart, 1, most);
    for (std::size_t j = 0; j < pieces; ++j) {
      const double begin = j == 0 ? part.t_begin : dense.StepBegin(from + j * steps / pieces);
      const double end =
          j + 1 == pieces ? part.t_end : dense.StepBegin(from + (j + 1) * steps / pieces);
      const double middle = begin + (end - begin) / 2;
      Matrix own = OfPiece(middle, end - begin, part.phi, e);
      own.topRows(d_) += (part.t_end - middle) * own.bottomRows(d_);
      change += own;
    }
    return change;
  }

 private:
  /// Of a piece of length T around t.
  Matrix OfPiece(double t, double T, const Matrix& phi, Vector e) {
    arc_.dense.Evaluate(t, x_.data());
    Matrix own = Matrix::Zero(2 * d_, phi.cols());
    double step =
        std::min(kMagnified, kStep * (1 + x_.cwiseAbs().maxCoeff()) / e.cwiseAbs().maxCoeff());
    Matrix left;
    if (!slips_.Empty()) {
      left = slips_.Left(x_, T);
      e = left * e;
      step = std::min(step, slips_.KeepDirections(x_, &e));
    }
    if (!(step > 0)) return own;
    Matrix bend = JacobianChange(&dynamics_, x_, arc_.mode, e, step), carried;
    if (left.size() > 0) bend.leftCols(2 * d_) *= left;
    MultiplyFewRows(1, bend, phi, &carried);
    own.bottomRows(d_) = T / 2 * (bend + carried);
    if (left.size() > 0) own = left * own;
    return own;
  }

  ContactDynamics& dynamics_;
  const Arc& arc_;
  const int d_;
  FollowedSlips slips_;
  Vector x_;
};

}  // namespace

Matrix PropagatorChange(ContactDynamics* dynamics, const Arc& arc,
                        const std::vector<ArcPart>& parts, const std::vector<Vector>& e) {
  const Eigen::Index d2 = 2 * dynamics->system().dof();
  const std::size_t most = std::max<std::size_t>(1, kMostParts / parts.size());
  ChangeOfArc changes(dynamics, arc);
  Matrix change, before;
  for (std::size_t l = 0; l < parts.size(); ++l) {
    const Matrix own = changes.OfPart(parts[l], most, e[l]);
    const Matrix& phi = parts[l].phi;
    change = l == 0 ? own : Matrix(phi.topLeftCorner(d2, d2) * change + own * before);
    if (l + 1 < parts.size()) before = l == 0 ? phi : Matrix(phi * before);
  }
  return change;
}

}  // namespace contact_flow
