// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// The configuration space Q of a system: a product of lines ℝ, circles SO(2) and rotation groups
/// SO(3) (Sec. 6.1 of the paper).
///
///   factor    position q                                        velocity v, tangent η
///   line      number                                            its rate
///   circle    angle [rad], winding allowed                      its rate [rad/s]
///   rotation  unit quaternion (w, x, y, z), body to world       its own, body axes [rad/s]
///
/// Positions have nq numbers and velocities d ≤ nq. A velocity moves the configuration by
/// q̇ = N(q) v; tangent vectors are left-trivialized, δq = N(q) η, so that derivatives have d
/// columns. SE(3) is three lines (the origin, in world axes) and a rotation.
class ConfigurationSpace {
 public:
  /// What the space is a product of.
  enum class Factor { kLine, kCircle, kRotation };

  ConfigurationSpace() = default;
  /// ℝᵈ.
  explicit ConfigurationSpace(int lines) { Append(Factor::kLine, lines); }

  /// Multiplies by `count` more factors, whose numbers come after those there are.
  ConfigurationSpace& Append(Factor factor, int count = 1);

  /// nq, the length of a configuration.
  int num_positions() const { return num_positions_; }
  /// d, the number of velocities.
  int dof() const { return dof_; }
  /// No rotations: q̇ = v.
  bool IsFlat() const { return rotations_.empty(); }

  /// First index of a rotation's quaternion in q, and of its angular velocity in v.
  struct Rotation {
    int q;  ///< in q
    int v;  ///< in v
  };
  /// Where the rotations are.
  const std::vector<Rotation>& rotations() const { return rotations_; }
  /// [nq] the index into v of each line and circle, −1 for the numbers of a quaternion.
  const std::vector<int>& line_velocities() const { return line_velocity_; }

  /// q̇ = N(q) v [nq].
  template <class S>
  void Rate(const S* q, const S* v, S* rate) const {
    if (IsFlat()) {
      std::copy_n(v, line_velocity_.size(), rate);
      return;
    }
    for (int k = 0; k < static_cast<int>(line_velocity_.size()); ++k) {
      if (line_velocity_[k] >= 0) rate[k] = v[line_velocity_[k]];
    }
    for (const Rotation& rotation : rotations_) {
      const S *a = q + rotation.q, *w = v + rotation.v;
      S* out = rate + rotation.q;  // ½ a ⊗ (0, ω)
      out[0] = -0.5 * (a[1] * w[0] + a[2] * w[1] + a[3] * w[2]);
      out[1] = 0.5 * (a[0] * w[0] + a[2] * w[2] - a[3] * w[1]);
      out[2] = 0.5 * (a[0] * w[1] + a[3] * w[0] - a[1] * w[2]);
      out[3] = 0.5 * (a[0] * w[2] + a[1] * w[1] - a[2] * w[0]);
    }
  }
  /// q ⊞ η = q exp(η) [nq].
  Vector Retract(const VectorRef& q, const VectorRef& eta) const;
  /// The shortest η [d] with `from` ⊞ η = `to`; circles and rotations wrap.
  Vector Difference(const VectorRef& to, const VectorRef& from) const;
  /// Makes the quaternions in q [nq] unit ones.
  void Normalize(double* q) const;
  /// Largest | |quaternion| − 1 | in q.
  double NormError(const VectorRef& q) const;
  /// ad_v [d×d], the bracket of velocities: ω × · for each rotation, zero elsewhere. For a tangent
  /// η carried along a motion, η̇ = δv − ad_v η.
  Matrix Bracket(const VectorRef& v) const;

 private:
  int num_positions_ = 0;
  int dof_ = 0;
  std::vector<int> line_velocity_;  // [nq] index into v of each line and circle, −1 in a quaternion
  std::vector<int> circles_;        // indices into q
  std::vector<Rotation> rotations_;
};

}  // namespace contact_flow
