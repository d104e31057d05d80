// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/radau.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "stage_solver.h"

namespace contact_flow {
namespace {

using Complex = std::complex<double>;

constexpr int kMaxIterations = 12;
/// Newton's method goes on until what it leaves is this part of the tolerance, or rounding.
constexpr double kNewton = 1e-5;
constexpr double kStageRounding = 64 * std::numeric_limits<double>::epsilon();  // of a stage
/// The error of the extension by its largest defect (measured: 2 to 6 times less).
constexpr double kDefectReach = 0.25;
/// A step that fails is repeated with a third of its length.
constexpr double kFailed = 1e6;
/// Beyond this many times the step before, its extension says less about the next one than the
/// linear equation does.
constexpr double kExtrapolates = 2.5;
/// Error of a first step by which it is guessed: that of a Taylor polynomial of its order.
constexpr double kGuess = 1e4;
constexpr double kSmallestGuess = 1e-6, kLeastLongest = 1e-4;  // the latter in [s]
constexpr double kLeastError = 1e-2;  // of the step before, in the prediction of the next one

}  // namespace

struct Radau::Solvers {
  StageSolver<double> real;
  std::vector<StageSolver<Complex>> pairs;
  Vector real_part;
  Eigen::VectorXcd pair_part;
  Matrix residual;
};

Radau::Radau(const ConfigurationSpace& space, int stages, Field field, Jacobian jacobian)
    : Stepper(space.num_positions() + space.dof(), -1.0 / (stages + 2),
              StagePlaces::OfRadau(stages)),
      space_(space),
      rule_(RadauRule::WithStages(stages)),
      field_(std::move(field)),
      jacobian_at_(std::move(jacobian)),
      solvers_(std::make_unique<Solvers>()),
      d_(space.dof()),
      end_place_(places().end),
      begin_slope_(n_),
      end_slope_(n_),
      Z_(n_, stages),
      F_(n_, stages),
      change_(n_, stages),
      rho_(n_),
      scale_(n_),
      stage_(n_),
      slope_(n_),
      last_dense_(kDenseOrder * n_),
      last_point_(n_) {
  begin_field_ = begin_slope_.data();
  end_field_ = end_slope_.data();
  error_factor_ = 1;
  solvers_->pairs.resize(rule_.eigenvalues.size());
}

Radau::~Radau() = default;

void Radau::Begin(const Vector& x) {
  x_ = x;
  field_(0, x_.data(), begin_slope_.data());
  jacobian_known_ = tried_ = has_last_ = false;
  factored_ = 0;
  last_contraction_ = 1;
}

void Radau::FindJacobian() {
  if (jacobian_known_) return;
  jacobian_at_(x_, &jacobian_);
  ++jacobians_;
  jacobian_known_ = true;
  factored_ = 0;
}

/// By the rate at which the field changes where it goes: stiff forces in balance do not change.
double Radau::GuessStep(double relative_tolerance, double absolute_tolerance) {
  FindJacobian();
  const auto v = x_.tail(d_);
  const auto a = begin_slope_.tail(d_);
  const double scale = absolute_tolerance + relative_tolerance * x_.lpNorm<Eigen::Infinity>();
  slope_.tail(d_).noalias() = jacobian_.leftCols(d_).lazyProduct(v);
  slope_.tail(d_).noalias() += jacobian_.rightCols(d_).lazyProduct(a);
  const double first = std::max(v.lpNorm<Eigen::Infinity>(), a.lpNorm<Eigen::Infinity>()) / scale;
  const double second =
      std::max(a.lpNorm<Eigen::Infinity>(), slope_.tail(d_).lpNorm<Eigen::Infinity>()) / scale;
  if (!(first > 0) || !(second > 0)) return kSmallestGuess;
  const double rate = second / first;  // [1/s]; what moves is about first / rate
  const double reach = std::pow(kGuess * rate / first, -exponent_);
  // No longer than it takes the state to become another one.
  const double longest = std::max(x_.lpNorm<Eigen::Infinity>() / (scale * first), kLeastLongest);
  return std::min(std::max(reach, kSmallestGuess) / rate, longest);
}

void Radau::Factor(double h) {
  FindJacobian();
  if (factored_ == h) return;
  const auto v = x_.tail(d_);
  solvers_->real.Factor(space_, v, jacobian_, rule_.real_eigenvalue / h);
  for (std::size_t k = 0; k < rule_.eigenvalues.size(); ++k) {
    solvers_->pairs[k].Factor(space_, v, jacobian_, rule_.eigenvalues[k] / h);
  }
  factored_ = h;
}

/// First values of the stages: by the extension of a step tried from here, or of the one before.
void Radau::Predict(double h) {
  if (tried_ && h <= h_) {
    if (!extended_) Extend();
    for (int i = 0; i < rule_.stages; ++i) {
      Interpolate(rule_.c(i) * h / h_, stage_.data());
      Z_.col(i) = stage_ - x_;
    }
  } else if (has_last_ && h <= kExtrapolates * last_step_) {
    for (int i = 0; i < rule_.stages; ++i) {
      EvaluateDenseStep(last_dense_.data(), n_, 1 + rule_.c(i) * h / last_step_, stage_.data());
      Z_.col(i) = stage_ - last_point_;
    }
  } else {  // an iteration whose field is known
    Z_.setZero();
    F_.colwise() = begin_slope_;
    Correct(h);
    Z_ += change_;
  }
}

/// One iteration from Z_, where the field is F_: R = F − A⁻¹Z/h into change_ = (A⁻¹/h − J)⁻¹ R.
void Radau::Correct(double h) {
  Matrix& residual = solvers_->residual;
  residual = F_;
  residual.noalias() -= (1 / h) * Z_.lazyProduct(rule_.inverse.transpose());
  solvers_->real_part.noalias() = residual.lazyProduct(rule_.to_real);
  solvers_->real.Solve(space_, x_.data(), &solvers_->real_part);
  change_.noalias() = solvers_->real_part.lazyProduct(rule_.from_real.transpose());
  for (std::size_t k = 0; k < rule_.eigenvalues.size(); ++k) {
    Eigen::VectorXcd& part = solvers_->pair_part;
    part.setZero(n_);
    for (int i = 0; i < rule_.stages; ++i) part += rule_.to_pair[k](i) * residual.col(i);
    solvers_->pairs[k].Solve(space_, x_.data(), &part);
    for (int i = 0; i < rule_.stages; ++i) {
      const Complex factor = rule_.from_pair[k](i);
      change_.col(i) += factor.real() * part.real() - factor.imag() * part.imag();
    }
  }
}

double Radau::Norm(const Vector& change) const {
  return std::sqrt(change.cwiseQuotient(scale_).squaredNorm() / n_);
}

/// Newton's method; false where it does not converge.
bool Radau::Iterate(double h, double relative_tolerance) {
  const double rounding = kStageRounding / relative_tolerance;
  double before = 0;
  contraction_ = std::pow(std::max(last_contraction_, kStageRounding), 0.8);
  for (iterations_ = 1; iterations_ <= kMaxIterations; ++iterations_) {
    for (int i = 0; i < rule_.stages; ++i) {
      stage_ = x_ + Z_.col(i);
      // The last stage is the end, whose place is Finish's.
      field_(i + 1 < rule_.stages ? i + 1 : end_place_, stage_.data(), F_.col(i).data());
    }
    Correct(h);
    Z_ += change_;
    double now = 0;
    for (int i = 0; i < rule_.stages; ++i) now = std::max(now, Norm(change_.col(i)));
    if (!std::isfinite(now)) return false;
    if (now <= rounding) return true;
    if (iterations_ > 1) {
      const double ratio = now / before;
      contraction_ = ratio < 1 ? ratio / (1 - ratio) : 1 / kStageRounding;
      const double left = now * std::pow(ratio, kMaxIterations - iterations_);
      if (ratio >= 1 || left > std::max(kNewton, rounding)) return false;
    }
    if (contraction_ * now <= kNewton) return true;
    before = now;
  }
  return false;
}

double Radau::Fail() {
  x_end_.setConstant(std::numeric_limits<double>::quiet_NaN());
  errors_.setConstant(std::numeric_limits<double>::infinity());
  tried_ = false;
  return error_ = kFailed;
}

/// An event at the point: a step of no length.
double Radau::Stay() {
  h_ = 0;
  tried_ = extended_ = false;
  Z_.setZero();
  rho_.setZero();
  errors_.setZero();
  x_end_ = x_;
  return error_ = 0;
}

double Radau::TryStep(double h, double relative_tolerance, double absolute_tolerance) {
  if (h == 0) return Stay();
  Factor(h);
  scale_ = (absolute_tolerance + relative_tolerance * x_.array().abs()).matrix();
  Predict(h);
  h_ = h;
  extended_ = false;
  tried_ = Iterate(h, relative_tolerance);
  if (!tried_) return Fail();
  x_end_ = x_ + Z_.col(rule_.stages - 1);
  return error_ = EstimateError(h, relative_tolerance, absolute_tolerance);
}

double Radau::EstimateError(double h, double relative_tolerance, double absolute_tolerance) {
  const int s = rule_.stages;
  const double sigma = rule_.real_eigenvalue / h;
  const auto filter = [&](Vector* defect) {
    *defect *= sigma;
    solvers_->real.Solve(space_, x_.data(), defect);
  };
  rho_.noalias() = Z_.lazyProduct(rule_.slope_at_begin);
  rho_ -= h * begin_slope_;
  filter(&rho_);
  errors_.setZero();
  for (int k = 0; k < 2; ++k) {
    stage_ = x_ + rho_ * rule_.value_at_check[k](s);
    stage_.noalias() += Z_.lazyProduct(rule_.value_at_check[k].head(s));
    field_(s + k, stage_.data(), slope_.data());
    slope_ *= -h;
    slope_ += rho_ * rule_.slope_at_check[k](s);
    slope_.noalias() += Z_.lazyProduct(rule_.slope_at_check[k].head(s));
    filter(&slope_);
    errors_ = errors_.cwiseMax(kDefectReach * slope_.cwiseAbs());
  }
  double sum = 0;
  for (int i = 0; i < n_; ++i) {
    const double scale =
        absolute_tolerance + relative_tolerance * std::max(std::abs(x_(i)), std::abs(x_end_(i)));
    sum += (errors_(i) / scale) * (errors_(i) / scale);
  }
  // And what is left of the iteration, which the length of the step does not make smaller.
  errors_ += contraction_ * change_.col(s - 1).cwiseAbs();
  return std::sqrt(sum / n_);
}

void Radau::Finish() { field_(end_place_, x_end_.data(), end_slope_.data()); }

void Radau::Extend() {
  const int s = rule_.stages;
  Eigen::Map<Matrix> c(dense_.data(), n_, kDenseOrder);
  c.col(0) = x_;
  c.col(1) = x_end_ - x_;
  for (int k = 2; k < kDenseOrder; ++k) {
    c.col(k) = rho_ * rule_.dense(k - 2, s);
    for (int i = 0; i < s; ++i) c.col(k) += rule_.dense(k - 2, i) * Z_.col(i);
  }
  extended_ = true;
}

void Radau::Advance() {
  if (!extended_) Extend();
  last_dense_.swap(dense_);
  last_point_ = x_end_;
  last_step_ = h_;
  last_error_ = std::max(error_, kLeastError);
  last_contraction_ = contraction_;
  has_last_ = true;
  x_.swap(x_end_);
  begin_slope_.swap(end_slope_);
  begin_field_ = begin_slope_.data();
  end_field_ = end_slope_.data();
  jacobian_known_ = tried_ = extended_ = false;
}

/// Predictive, after Gustafsson: errors that grow go on growing. Many iterations cost more than
/// two steps.
double Radau::Growth(double error) const {
  constexpr double kMany = 2.0 * kMaxIterations;
  double growth = Stepper::Growth(error);
  if (has_last_) {
    const double trend = last_error_ / std::max(error, 1e-30);
    growth = std::min(growth, growth * (h_ / last_step_) * std::pow(trend, -exponent_));
  }
  return growth * (1 + kMany) / (iterations_ + kMany);
}

double Radau::Stiffness() {
  constexpr int kPowers = 12, kDiscarded = 6;
  FindJacobian();
  Vector y(2 * d_), next(2 * d_);
  for (int i = 0; i < 2 * d_; ++i) y(i) = 1 + 0.37 * (i % 5);
  double growth = 0;
  for (int k = 0; k < kPowers; ++k) {
    next.head(d_) = y.tail(d_);
    next.tail(d_).noalias() = jacobian_ * y;
    const double size = next.norm();
    if (!(size > 0) || !std::isfinite(size)) return 0;
    if (k >= kDiscarded) growth += std::log(size);
    y = next / size;
  }
  return last_step_ * std::exp(growth / (kPowers - kDiscarded));
}

}  // namespace contact_flow
