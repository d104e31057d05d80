// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/configuration_space.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace contact_flow {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
/// Below this angle [rad] the series of sin(φ/2)/φ to second order is exact to rounding.
constexpr double kSmallAngle = 1e-4;

Quaterniond QuaternionAt(const double* q) { return Quaterniond(q[0], q[1], q[2], q[3]); }

/// exp(η): the rotation by |η| about η.
Quaterniond Exponential(const Vector3d& eta) {
  const double angle = eta.norm();
  const double ratio =
      angle < kSmallAngle ? 0.5 - angle * angle / 48 : std::sin(0.5 * angle) / angle;
  return Quaterniond(std::cos(0.5 * angle), ratio * eta.x(), ratio * eta.y(), ratio * eta.z());
}

/// The inverse of Exponential, |η| ≤ π.
Vector3d Logarithm(const Quaterniond& rotation) {
  const double sign = rotation.w() < 0 ? -1 : 1;
  const Vector3d axis = sign * rotation.vec();
  const double sine = axis.norm(), cosine = sign * rotation.w();
  if (sine < kSmallAngle * cosine) {
    const double tangent = sine / cosine;
    return (2 / cosine) * (1 - tangent * tangent / 3) * axis;
  }
  return 2 * std::atan2(sine, cosine) / sine * axis;
}

}  // namespace

ConfigurationSpace& ConfigurationSpace::Append(Factor factor, int count) {
  for (int k = 0; k < count; ++k) {
    if (factor == Factor::kRotation) {
      rotations_.push_back({num_positions_, dof_});
      line_velocity_.insert(line_velocity_.end(), 4, -1);
      num_positions_ += 4;
      dof_ += 3;
    } else {
      if (factor == Factor::kCircle) circles_.push_back(num_positions_);
      line_velocity_.push_back(dof_);
      ++num_positions_;
      ++dof_;
    }
  }
  return *this;
}

Vector ConfigurationSpace::Retract(const VectorRef& q, const VectorRef& eta) const {
  Vector result = q;
  for (int k = 0; k < num_positions_; ++k) {
    if (line_velocity_[k] >= 0) result(k) += eta(line_velocity_[k]);
  }
  for (const Rotation& rotation : rotations_) {
    const Quaterniond moved =
        QuaternionAt(q.data() + rotation.q) * Exponential(eta.segment<3>(rotation.v));
    result.segment<4>(rotation.q) << moved.w(), moved.x(), moved.y(), moved.z();
  }
  return result;
}

Vector ConfigurationSpace::Difference(const VectorRef& to, const VectorRef& from) const {
  Vector eta(dof_);
  for (int k = 0; k < num_positions_; ++k) {
    if (line_velocity_[k] >= 0) eta(line_velocity_[k]) = to(k) - from(k);
  }
  for (int k : circles_) {
    double& angle = eta(line_velocity_[k]);
    if (std::abs(angle) > kPi) angle = std::remainder(angle, 2 * kPi);
  }
  for (const Rotation& rotation : rotations_) {
    eta.segment<3>(rotation.v) = Logarithm(QuaternionAt(from.data() + rotation.q).conjugate() *
                                           QuaternionAt(to.data() + rotation.q));
  }
  return eta;
}

void ConfigurationSpace::Normalize(double* q) const {
  for (const Rotation& rotation : rotations_) {
    Eigen::Map<Eigen::Vector4d>(q + rotation.q).normalize();
  }
}

double ConfigurationSpace::NormError(const VectorRef& q) const {
  double error = 0;
  for (const Rotation& rotation : rotations_) {
    error = std::max(error, std::abs(q.segment<4>(rotation.q).norm() - 1));
  }
  return error;
}

Matrix ConfigurationSpace::Bracket(const VectorRef& v) const {
  Matrix bracket = Matrix::Zero(dof_, dof_);
  for (const Rotation& rotation : rotations_) {
    const int k = rotation.v;
    bracket(k, k + 1) = -v(k + 2);
    bracket(k, k + 2) = v(k + 1);
    bracket(k + 1, k) = v(k + 2);
    bracket(k + 1, k + 2) = -v(k);
    bracket(k + 2, k) = -v(k + 1);
    bracket(k + 2, k + 1) = v(k);
  }
  return bracket;
}

}  // namespace contact_flow
