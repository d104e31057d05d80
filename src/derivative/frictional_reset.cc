// SPDX-License-Identifier: BSD-3-Clause
#include "frictional_reset.h"

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

#include "contact_flow/model/driven.h"
#include "contact_flow/model/row_layout.h"

namespace contact_flow {
namespace {

/// How closely the inequalities of the impact have to hold, relative: at least, and in tolerances.
constexpr double kResetBorder = 1e-9, kKnownSpeed = 10;
/// A direction lies on the wrong side of a border by more than this, relative.
constexpr double kAcross = 1e-9;
/// Where it is on the wrong side of a border of each branch, one that it misses by less than this
/// is its own: what w should not move is moved by the errors of w. Branches are the same there.
constexpr double kNearby = 1e-7;
/// What no tangent that keeps the contacts moves, relative.
constexpr double kLeft = 1e-8;

/// The cone |λ_t| ≤ μ λ_n around λ = 0, by rows of μ λ_n and λ_t. In space by the part of it in
/// which |λ_1| + |λ_2| ≤ μ λ_n: elsewhere no branch is found.
void AddApex(const Eigen::RowVectorXd& pressing, const Matrix& along,
             std::vector<Eigen::RowVectorXd>* borders) {
  for (const double first : {-1, 1}) {
    if (along.rows() == 1) borders->push_back(pressing + first * along.row(0));
    for (const double second : {-1, 1}) {
      if (along.rows() == 1) continue;
      borders->push_back(pressing + first * along.row(0) + second * along.row(1));
    }
  }
}

}  // namespace

FrictionalReset::FrictionalReset(const ContactDynamics& dynamics, const Vector& x,
                                 ConstraintSet touching, int hit, ContactMode mode,
                                 const Transition& cluster)
    : dynamics_(dynamics),
      system_(dynamics.system()),
      x_(x),
      d_(system_.dof()),
      nq_(system_.num_positions()),
      size_(2 * d_ + dynamics.num_variables()),
      t_(cluster.t),
      border_(std::max(kResetBorder, kKnownSpeed * cluster.relative_tolerance)),
      persisting_(mode.Members().Without(hit)),
      after_(cluster.mode_after),
      inertia_(system_, x.head(nq_), x.tail(d_)),
      frame_(system_, inertia_, Sharing(system_, inertia_, x, touching, persisting_)) {
  FrictionProblem& problem = frame_.problem();
  problem.b = frame_.rows() * x.tail(d_);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int i = frame_.constraints()[k];
    problem.b(problem.Row(k)) *= persisting_.Contains(i) ? 1 : 1 + system_.restitution()(i);
  }
  problem.rounding = frame_.RateRounding(inertia_, x.tail(d_), mode.Among(persisting_));
  const double scale = problem.b.cwiseAbs().maxCoeff();
  std::vector<FrictionSolution> all = SolveFriction(problem, border_);
  if (all.empty()) throw std::domain_error("an impact of the perturbed run has no solution");
  if (all.front().springs) {
    throw std::domain_error("an impact of the perturbed run depends on how impulses are shared");
  }
  CheckBrushed(all.front(), hit, scale);
  for (FrictionSolution& solution : all) {
    const Vector v_plus = frame_.VelocityAfter(inertia_, x.tail(d_), &solution);
    if (branches_.empty()) v_plus_ = v_plus;
    branches_.push_back(Differentiate(solution, v_plus, scale));
  }
}

FrictionalReset::Branch FrictionalReset::Differentiate(const FrictionSolution& solution,
                                                       const Vector& v_plus, double scale) const {
  const FrictionProblem& problem = frame_.problem();
  const Vector v_minus = x_.tail(d_), q = x_.head(nq_);
  const Vector impulse = frame_.Impulse(inertia_, solution.force);
  const Matrix& A = inertia_.terms().jacobian;
  const RowLayout rows(system_);
  const std::vector<int>& parameters = dynamics_.variables().parameters;
  const auto first_parameter = size_ - static_cast<Eigen::Index>(parameters.size());

  Branch branch;
  struct Unknown {
    int row;             // of its equation
    double restitution;  // of it
    Vector push;         // column of W [d]
    std::size_t contact;
  };
  std::vector<Unknown> unknowns;
  Matrix turning = Matrix::Zero(d_, d_);  // what v⁺ adds to r₁ by the direction of slip
  Matrix by_friction = Matrix::Zero(d_, static_cast<Eigen::Index>(parameters.size()));
  const Matrix friction_by_parameter = system_.DifferentiateFriction(parameters);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int i = frame_.constraints()[k];
    const FrictionContact& contact = problem.contacts[k];
    const Letter letter = solution.letters[k];
    if (letter == Letter::kOpen) continue;
    branch.word.Set(i, contact.dimension == 0 ? Letter::kSlip : letter);
    const double restitution = persisting_.Contains(i) ? 0 : system_.restitution()(i);
    Unknown normal{i, restitution, A.row(i).transpose(), k};
    const int row = contact.dimension > 0 ? system_.friction()[i].row : 0;
    if (letter == Letter::kStick) {
      unknowns.push_back(normal);
      for (int j = 0; j < contact.dimension; ++j) {
        unknowns.push_back({row + j, 0, A.row(row + j).transpose(), k});
      }
      continue;
    }
    if (contact.dimension > 0) {
      const auto T = A.middleRows(row, contact.dimension);
      const Vector direction = solution.directions[k].head(contact.dimension);
      normal.push -= contact.coefficient * (T.transpose() * direction);
      by_friction += impulse(i) * (T.transpose() * direction) * friction_by_parameter.row(i);
      if (contact.dimension == 2) {
        const double speed = (T * v_plus).norm();
        turning += contact.coefficient * impulse(i) / speed * T.transpose() *
                   (Matrix::Identity(2, 2) - direction * direction.transpose()) * T;
      }
    }
    if (contact.dimension == 0 && !parameters.empty() && !friction_by_parameter.row(i).isZero(0)) {
      by_friction += impulse(i) * FreeSlip(i, v_plus) * friction_by_parameter.row(i);
    }
    unknowns.push_back(normal);
  }
  for (int i = 0; i < system_.num_bilateral(); ++i) {
    const int row = rows.OfBilateral(i);
    unknowns.push_back({row, 0, A.row(row).transpose(), 0});
  }

  const auto m = static_cast<Eigen::Index>(unknowns.size());
  Matrix kkt = Matrix::Zero(d_ + m, d_ + m);
  Matrix rhs = Matrix::Zero(d_ + m, size_);
  kkt.topLeftCorner(d_, d_) = inertia_.mass() + turning;
  rhs.block(0, d_, d_, d_) = inertia_.mass();
  ResidualJacobian after, before;
  const Vector jump = v_plus - v_minus;
  system_.DifferentiateImpact(q, jump, impulse, v_plus, &after);
  system_.DifferentiateImpact(q, jump, impulse, v_minus, &before);
  rhs.topLeftCorner(d_, d_) = -after.momentum_q;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const FrictionContact& contact = problem.contacts[k];
    const bool turns = solution.letters[k] == Letter::kSlip && contact.dimension == 2;
    if (!turns) continue;
    const int i = frame_.constraints()[k], row = system_.friction()[i].row;
    const auto T = A.middleRows<2>(row);
    const Eigen::Vector2d& direction = solution.directions[k];
    rhs.topLeftCorner(d_, d_) -= contact.coefficient * impulse(i) / (T * v_plus).norm() *
                                 T.transpose() *
                                 (Eigen::Matrix2d::Identity() - direction * direction.transpose()) *
                                 after.constraint_q.middleRows<2>(row);
  }
  ParameterJacobian parameter_after, parameter_before;
  if (!parameters.empty()) {
    system_.DifferentiateImpactByParameters(q, jump, impulse, v_plus, parameters, &parameter_after);
    system_.DifferentiateImpactByParameters(q, jump, impulse, v_minus, parameters,
                                            &parameter_before);
    rhs.topRightCorner(d_, size_ - first_parameter) = -parameter_after.momentum - by_friction;
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      const FrictionContact& contact = problem.contacts[k];
      if (solution.letters[k] != Letter::kSlip || contact.dimension != 2) continue;
      const int i = frame_.constraints()[k], row = system_.friction()[i].row;
      const auto T = A.middleRows<2>(row);
      const Eigen::Vector2d& direction = solution.directions[k];
      rhs.topRightCorner(d_, size_ - first_parameter) -=
          contact.coefficient * impulse(i) / (T * v_plus).norm() * T.transpose() *
          (Eigen::Matrix2d::Identity() - direction * direction.transpose()) *
          parameter_after.constraint.middleRows<2>(row);
    }
  }
  Eigen::Index bounces = -1;  // its unknown
  for (Eigen::Index k = 0; k < m; ++k) {
    const Unknown& u = unknowns[static_cast<std::size_t>(k)];
    kkt.col(d_ + k).head(d_) = -u.push;
    kkt.row(d_ + k).head(d_) = A.row(u.row);
    rhs.row(d_ + k).head(d_) =
        -after.constraint_q.row(u.row) - u.restitution * before.constraint_q.row(u.row);
    rhs.row(d_ + k).segment(d_, d_) = -u.restitution * A.row(u.row);
    if (parameters.empty()) continue;
    auto by_parameter = rhs.row(d_ + k).tail(size_ - first_parameter);
    by_parameter = -parameter_after.constraint.row(u.row) -
                   u.restitution * parameter_before.constraint.row(u.row);
    if (!rows.IsNormal(u.row) || persisting_.Contains(u.row)) continue;
    const Eigen::RowVectorXd rise =
        -parameter_after.restitution.row(u.row) * A.row(u.row).dot(v_minus);
    // A plastic contact that is held comes to rest all the same: its bounces, of a speed of first
    // order, are over after a time of first order (BounceToRest).
    if (!after_.Contains(u.row) || u.restitution != 0) {
      by_parameter += rise;
    } else if (!rise.isZero(0)) {
      branch.bounce_speed = Eigen::RowVectorXd::Zero(size_);
      branch.bounce_speed.tail(rise.size()) = rise;
      bounces = k;
    }
  }
  const bool shared = solution.interior.size() > 0;
  if (bounces >= 0) {
    rhs.conservativeResize(Eigen::NoChange, size_ + 1);
    rhs.col(size_) = Vector::Unit(d_ + m, d_ + bounces);
  }
  // What is driven goes on as before: its inertia is no pivot of other rows.
  for (int j : Driven(inertia_.mass())) {
    kkt.row(j) = Vector::Unit(d_ + m, j).transpose();
    rhs.row(j) = Vector::Unit(rhs.cols(), d_ + j).transpose();
  }
  Matrix solved;
  if (shared) {
    Vector unit = kkt.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
    for (Eigen::Index k = 0; k < m; ++k) {
      unit(d_ + k) = 1 / kkt.row(d_ + k).head(d_).cwiseProduct(unit.head(d_).transpose()).norm();
    }
    solved = SolveConsistent(kkt, unit, rhs);
  } else {
    solved = kkt.partialPivLu().solve(rhs);
  }
  if (bounces >= 0) {
    branch.bounce = solved.col(size_).head(d_);
    solved.conservativeResize(Eigen::NoChange, size_);
  }
  branch.jacobian = Matrix::Identity(size_, size_);
  branch.jacobian.middleRows(d_, d_) = solved.topRows(d_);

  // D(A v⁺) and D(A v⁻) of the contact rows; impulses of the unknowns.
  Matrix rate(A.rows(), size_), old_rate = Matrix::Zero(A.rows(), size_);
  rate = A * branch.jacobian.middleRows(d_, d_);
  rate.leftCols(d_) += after.constraint_q;
  old_rate.leftCols(d_) = before.constraint_q;
  old_rate.middleCols(d_, d_) = A;
  if (!parameters.empty()) {
    rate.rightCols(size_ - first_parameter) += parameter_after.constraint;
    old_rate.rightCols(size_ - first_parameter) += parameter_before.constraint;
  }
  // At rest, whoever moves w, is what no tangent moves that keeps the contacts: it bounds none.
  const Matrix kept = KeptRows(A, old_rate, parameter_before);
  std::vector<Eigen::RowVectorXd> borders;
  const auto offer = [&](double value, const Eigen::RowVectorXd& gradient) {
    if (std::abs(value) > border_ * scale) return;
    const double left = (gradient - gradient * kept * kept.transpose()).norm();
    if (left > kLeft * gradient.norm()) borders.push_back(gradient);
  };
  if (shared && !(solution.margin > border_)) {
    throw std::domain_error("an impact of contacts that share impulses is on a border of theirs");
  }
  for (std::size_t k = 0; k < problem.contacts.size() && !shared; ++k) {
    const int i = frame_.constraints()[k], row = problem.Row(k);
    const FrictionContact& contact = problem.contacts[k];
    const Letter letter = solution.letters[k];
    const double gain = problem.G(row, row);
    if (letter == Letter::kOpen) {
      const double restitution = persisting_.Contains(i) ? 0 : system_.restitution()(i);
      offer(solution.result(row), rate.row(i) + restitution * old_rate.row(i));
      continue;
    }
    Eigen::Index place = 0;
    while (unknowns[static_cast<std::size_t>(place)].row != i) ++place;
    const Eigen::RowVectorXd normal = solved.row(d_ + place);
    if (letter == Letter::kStick && std::isfinite(contact.coefficient)) {
      const auto tangential = solution.force.segment(row + 1, contact.dimension);
      const double size = tangential.norm();
      const auto push = solved.middleRows(d_ + place + 1, contact.dimension);
      Eigen::RowVectorXd cone = contact.coefficient * normal;
      const double apex = border_ * scale / gain;
      if (size <= apex && contact.coefficient * solution.force(row) <= apex) {
        AddApex(gain * cone, gain * push, &borders);
        continue;
      }
      if (size > 0) cone -= (tangential.transpose() / size) * push;
      if (!parameters.empty()) {
        cone.tail(size_ - first_parameter) += solution.force(row) * friction_by_parameter.row(i);
      }
      offer(gain * (contact.coefficient * solution.force(row) - size), gain * cone);
      continue;
    }
    offer(gain * solution.force(row), gain * normal);
    if (contact.dimension == 1) {
      const double sign = solution.directions[k](0);
      offer(sign * solution.result(row + 1), sign * rate.row(system_.friction()[i].row));
    }
  }
  branch.borders.resize(static_cast<Eigen::Index>(borders.size()), size_);
  for (std::size_t k = 0; k < borders.size(); ++k) {
    branch.borders.row(static_cast<Eigen::Index>(k)) = borders[k];
  }
  return branch;
}

/// Tᵀ d of a contact whose coefficient is 0, and would be a little more.
Vector FrictionalReset::FreeSlip(int i, const Vector& v_plus) const {
  const Friction& friction = system_.friction()[i];
  const Matrix T = inertia_.terms().jacobian.middleRows(friction.row, friction.dimension);
  const Vector slip = T * v_plus;
  if (!(slip.norm() > kAcross * (T.cwiseAbs() * v_plus.cwiseAbs()).norm())) {
    throw std::domain_error("contact '" + system_.description().constraints[i] +
                            "', whose friction is 0, lands without slip: which way friction would "
                            "act is not decided");
  }
  return T.transpose() * slip.normalized();
}

const FrictionalReset::Branch& FrictionalReset::Choose(
    const Vector& w, const Vector& sizes,
    const std::function<void(const Eigen::RowVectorXd&)>& decide) const {
  const Branch* chosen = nullptr;
  double least = kNearby;
  for (const Branch& branch : branches_) {
    if (!branch.jacobian.allFinite()) continue;
    bool fits = true;
    double beyond = 0;
    for (Eigen::Index k = 0; k < branch.borders.rows(); ++k) {
      const auto row = branch.borders.row(k);
      fits = fits && row.dot(w) >= -kAcross * row.cwiseAbs().dot(sizes.head(row.size()));
      const double size = row.cwiseAbs().maxCoeff() * sizes.maxCoeff();
      if (row.dot(w) < 0) beyond = std::max(beyond, -row.dot(w) / size);
    }
    if (!fits && !(beyond < least)) continue;
    chosen = &branch;
    least = beyond;
    if (fits) break;
  }
  if (chosen == nullptr) {
    throw std::domain_error("an impact of the perturbed run is on a border that is not decided");
  }
  if (branches_.size() > 1) {
    for (Eigen::Index k = 0; k < chosen->borders.rows(); ++k) decide(chosen->borders.row(k));
  }
  return *chosen;
}

}  // namespace contact_flow
