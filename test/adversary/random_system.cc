// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/random_system.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace contact_flow {
namespace adversary {
namespace {

constexpr double kFlat = 6;  // exp(−36) = 2e-16: nothing is left of a bump

}  // namespace

double Ridge::Derivative(const VectorRef& q, int k) const {
  const double z = (e.dot(q) - centre) / width, w = width;
  if (bump) {
    if (std::abs(z) > 40) return 0;
    const double b = std::exp(-z * z);
    switch (k) {
      case 0:
        return b;
      case 1:
        return -2 * z * b / w;
      case 2:
        return (4 * z * z - 2) * b / (w * w);
      default:
        return (12 * z - 8 * z * z * z) * b / (w * w * w);
    }
  }
  switch (k) {
    case 0:
      return std::sin(z);
    case 1:
      return std::cos(z) / w;
    case 2:
      return -std::sin(z) / (w * w);
    default:
      return -std::cos(z) / (w * w * w);
  }
}

double Ridge::TimeScale(const VectorRef& q, const VectorRef& v) const {
  const double speed = std::abs(e.dot(v));
  if (!(speed > 0)) return std::numeric_limits<double>::infinity();
  if (!bump) return width / speed;
  const double z = (e.dot(q) - centre) / width;
  const bool leaves = z * e.dot(v) > 0;
  if (std::abs(z) <= kFlat) return width / speed;
  if (leaves) return std::numeric_limits<double>::infinity();
  return (1 + std::abs(z) - kFlat) * width / speed;
}

RandomSystem::RandomSystem(Coefficients coefficients, double load, double shift)
    : c_(std::move(coefficients)) {
  const int d = c_.dof(), n = static_cast<int>(c_.gaps.size());
  c_.load *= load;
  if (n > 0) c_.gaps[0].offset += shift;
  description_.name = "random";
  description_.summary = "a system of random coefficients";
  for (int i = 0; i < d; ++i) {
    description_.coordinates.push_back("q" + std::to_string(i));
    description_.units.push_back("m");
  }
  description_.velocities = description_.coordinates;
  for (int i = 0; i < n; ++i) description_.constraints.push_back("a" + std::to_string(i));
  for (int i = 0; i < c_.input.cols(); ++i) description_.inputs.push_back("u" + std::to_string(i));
  description_.parameters = {{"load", "", "factor on the constant force", load},
                             {"shift", "m", "added to the first gap", shift}};
  space_ = ConfigurationSpace(d);
  restitution_ = c_.restitution;
  nominal_.x = Vector::Zero(2 * d);
  nominal_.u = Vector::Zero(c_.input.cols());
  for (const GapTerms& gap : c_.gaps) {
    affine_ = affine_ && gap.curvature.size() == 0 && gap.ridges.empty();
  }
}

double RandomSystem::TimeScale(const VectorRef& q, const VectorRef& v) const {
  double scale = std::numeric_limits<double>::infinity();
  for (const ForceRidge& term : c_.ridges) scale = std::min(scale, term.ridge.TimeScale(q, v));
  for (const GapTerms& gap : c_.gaps) {
    for (const auto& [amplitude, ridge] : gap.ridges) {
      if (amplitude != 0) scale = std::min(scale, ridge.TimeScale(q, v));
    }
  }
  return scale;
}

// The reference calls these millions of times: products by coefficients, nothing on the heap.
void RandomSystem::Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                            const ContactMode&, Matrix* mass, Vector* force) const {
  if (mass != nullptr) *mass = c_.mass;
  *force = c_.load;
  *force += c_.stiffness.lazyProduct(q);
  *force += c_.damping.lazyProduct(v);
  if (c_.input.cols() > 0) *force += c_.input.lazyProduct(u);
  for (int i = 0; i < static_cast<int>(c_.quadratic.size()); ++i) {
    (*force)(i) += v.dot(c_.quadratic[i].lazyProduct(v));
  }
  for (const ForceRidge& term : c_.ridges) {
    *force += term.ridge.Derivative(q, 0) * term.amplitude;
  }
  for (int k = 0; k < static_cast<int>(c_.mass_slopes.size()); ++k) {
    if (mass != nullptr) *mass += std::sin(q(k)) * c_.mass_slopes[k];
    // c v = ½ ∂_q (vᵀ M v) − Ṁ v.
    const SmallVector slope_v = std::cos(q(k)) * c_.mass_slopes[k].lazyProduct(v);
    (*force)(k) += 0.5 * v.dot(slope_v);
    *force -= v(k) * slope_v;
  }
}

Vector RandomSystem::HessianTimes(const GapTerms& gap, const VectorRef& q,
                                  const VectorRef& s) const {
  Vector product = Vector::Zero(c_.dof());
  if (gap.curvature.size() > 0) product += gap.curvature * s;
  for (const auto& [amplitude, ridge] : gap.ridges) {
    product += amplitude * ridge.Derivative(q, 2) * ridge.e.dot(s) * ridge.e;
  }
  return product;
}

void RandomSystem::Constraints(const VectorRef& q, const VectorRef& v,
                               ConstraintTerms* terms) const {
  const int n = static_cast<int>(c_.gaps.size());
  terms->gap.resize(n);
  terms->jacobian.resize(n, c_.dof());
  terms->bias.resize(n);
  for (int i = 0; i < n; ++i) {
    const GapTerms& gap = c_.gaps[i];
    double value = gap.offset + gap.normal.dot(q), bias = 0;
    SmallVector gradient = gap.normal;
    if (gap.curvature.size() > 0) {
      const SmallVector curved = gap.curvature.lazyProduct(q);
      value += 0.5 * q.dot(curved);
      gradient += curved;
      bias += v.dot(gap.curvature.lazyProduct(v));
    }
    for (const auto& [amplitude, ridge] : gap.ridges) {
      const double speed = ridge.e.dot(v);
      value += amplitude * ridge.Derivative(q, 0);
      gradient += amplitude * ridge.Derivative(q, 1) * ridge.e;
      bias += amplitude * ridge.Derivative(q, 2) * speed * speed;
    }
    terms->gap(i) = value;
    terms->jacobian.row(i) = gradient;
    terms->bias(i) = bias;
  }
}

void RandomSystem::DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef&,
                                         const ContactMode&, const VectorRef& acceleration,
                                         const VectorRef& force, ResidualJacobian* jacobian) const {
  const int d = c_.dof(), n = static_cast<int>(c_.gaps.size());
  Matrix& by_q = jacobian->momentum_q;
  Matrix& by_v = jacobian->momentum_v;
  by_q = -c_.stiffness;
  by_v = -c_.damping;
  jacobian->momentum_u = -c_.input;
  for (int i = 0; i < static_cast<int>(c_.quadratic.size()); ++i) {
    by_v.row(i) -= 2 * (c_.quadratic[i] * v).transpose();
  }
  for (const ForceRidge& term : c_.ridges) {
    by_q -= term.ridge.Derivative(q, 1) * term.amplitude * term.ridge.e.transpose();
  }
  for (int k = 0; k < static_cast<int>(c_.mass_slopes.size()); ++k) {
    const Matrix& slope = c_.mass_slopes[k];
    const Vector slope_v = slope * v;
    const double c = std::cos(q(k)), s = std::sin(q(k));
    by_q.col(k) += c * (slope * acceleration);
    by_q(k, k) += 0.5 * s * v.dot(slope_v);
    by_q.col(k) -= v(k) * s * slope_v;
    by_v.row(k) -= c * slope_v.transpose();
    by_v += v(k) * c * slope;
    by_v.col(k) += c * slope_v;
  }
  jacobian->constraint_q.setZero(n, d);
  jacobian->constraint_v.setZero(n, d);
  for (int i = 0; i < n; ++i) {
    const GapTerms& gap = c_.gaps[i];
    if (gap.curvature.size() > 0 && force(i) != 0) by_q -= force(i) * gap.curvature;
    jacobian->constraint_q.row(i) = HessianTimes(gap, q, acceleration);
    jacobian->constraint_v.row(i) = 2 * HessianTimes(gap, q, v);
    for (const auto& [amplitude, ridge] : gap.ridges) {
      by_q -= force(i) * amplitude * ridge.Derivative(q, 2) * ridge.e * ridge.e.transpose();
      const double speed = ridge.e.dot(v);
      jacobian->constraint_q.row(i) +=
          amplitude * ridge.Derivative(q, 3) * speed * speed * ridge.e.transpose();
    }
  }
}

void RandomSystem::DifferentiateImpact(const VectorRef& q, const VectorRef& jump,
                                       const VectorRef& impulse, const VectorRef& s,
                                       ResidualJacobian* jacobian) const {
  const int d = c_.dof(), n = static_cast<int>(c_.gaps.size());
  jacobian->momentum_q.setZero(d, d);
  for (int k = 0; k < static_cast<int>(c_.mass_slopes.size()); ++k) {
    jacobian->momentum_q.col(k) += std::cos(q(k)) * (c_.mass_slopes[k] * jump);
  }
  jacobian->constraint_q.setZero(n, d);
  for (int i = 0; i < n; ++i) {
    const GapTerms& gap = c_.gaps[i];
    if (gap.curvature.size() > 0) jacobian->momentum_q -= impulse(i) * gap.curvature;
    for (const auto& [amplitude, ridge] : gap.ridges) {
      jacobian->momentum_q -=
          impulse(i) * amplitude * ridge.Derivative(q, 2) * ridge.e * ridge.e.transpose();
    }
    jacobian->constraint_q.row(i) = HessianTimes(gap, q, s);
  }
}

void RandomSystem::DifferentiateDynamicsByParameters(const VectorRef&, const VectorRef&,
                                                     const VectorRef&, const ContactMode&,
                                                     const VectorRef&, const VectorRef&,
                                                     const std::vector<int>& parameters,
                                                     ParameterJacobian* jacobian) const {
  const int k = static_cast<int>(parameters.size());
  jacobian->momentum.setZero(c_.dof(), k);
  jacobian->constraint.setZero(c_.gaps.size(), k);
  for (int j = 0; j < k; ++j) {
    if (parameters[j] != 0) continue;
    jacobian->momentum.col(j) = -c_.load / description_.parameters[0].value;
  }
}

void RandomSystem::DifferentiateImpactByParameters(const VectorRef&, const VectorRef&,
                                                   const VectorRef&, const VectorRef&,
                                                   const std::vector<int>& parameters,
                                                   ParameterJacobian* jacobian) const {
  const int k = static_cast<int>(parameters.size()), n = static_cast<int>(c_.gaps.size());
  jacobian->momentum.setZero(c_.dof(), k);
  jacobian->constraint.setZero(n, k);
  jacobian->gap.setZero(n, k);
  jacobian->restitution.setZero(n, k);
  for (int j = 0; j < k; ++j) {
    if (parameters[j] == 1 && n > 0) jacobian->gap(0, j) = 1;
  }
}

}  // namespace adversary
}  // namespace contact_flow
