// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {
namespace effort {

/// Spring and damper between two frames, a bushing: at points of two links, with the links' axes.
/// With p the points, θ the angle between the frames about the unit axis n, ω their relative
/// angular velocity, the force on the first point and the torque on the first link are
///   F = −stiffness r − damping (ṙ − ω_other × r),      r = p − p_other,
///   τ = −turn_stiffness sin θ n − turn_damping ω,      of the energy turn_stiffness (1 − cos θ):
/// smooth at all angles, and linear in small ones; the other link feels −F at the first point, and
/// −τ. They go by forces on points at the tips of the axes, a_x × f_x + a_y × f_y = τ.
struct FrameSpring {
  static constexpr const char* kName = "frame_spring";
  static constexpr int kPoints = 6, kJoints = 0, kInputs = 0, kNumbers = 4;

  static void Read(ElementFields* fields) {
    fields->Point("link", "point");
    fields->Tip(Vec3<double>::UnitX());
    fields->Tip(Vec3<double>::UnitY());
    fields->Point("other_link", "other_point");
    fields->Tip(Vec3<double>::UnitX());
    fields->Tip(Vec3<double>::UnitY());
    fields->Number("stiffness", 0, "N/m", "pull per distance", Range::kNonNegative);
    fields->Number("damping", 0, "N s/m", "pull per speed", Range::kNonNegative);
    fields->Number("turn_stiffness", 0, "N m/rad", "torque per angle", Range::kNonNegative);
    fields->Number("turn_damping", 0, "N m s/rad", "torque per angular velocity",
                   Range::kNonNegative);
  }

  template <class S>
  static void Effort(const S* number, const S* z, const S* rate, const S*, S* e) {
    Vec3<S> axes[2][3], spin[2], torque = Zero3<S>();
    for (int f = 0; f < 2; ++f) {
      Vec3<S>* a = axes[f];
      Vec3<S> change[3];
      for (int k = 0; k < 2; ++k) {
        a[k] = Between(z + 9 * f, 3 + 3 * k);
        change[k] = Between(rate + 9 * f, 3 + 3 * k);
      }
      a[2] = Cross(a[0], a[1]);
      change[2] = Cross(change[0], a[1]) + Cross(a[0], change[1]);
      spin[f] = Zero3<S>();
      for (int k = 0; k < 3; ++k) spin[f] += Scaled(0.5, Cross(a[k], change[k]));
    }
    // ½ Σ a × b is sin θ n, from the first frame to the other.
    const S half = 0.5 * number[2];
    for (int k = 0; k < 3; ++k) torque += Scaled(half, Cross(axes[0][k], axes[1][k]));
    torque += Scaled(number[3], Vec3<S>(spin[1] - spin[0]));
    Vec3<S> arm, speed;
    for (int k = 0; k < 3; ++k) {
      arm(k) = z[k] - z[9 + k];
      speed(k) = rate[k] - rate[9 + k];
    }
    speed = Vec3<S>(speed - Cross(spin[1], arm));
    const Vec3<S> force = -(Scaled(number[0], arm) + Scaled(number[1], speed));
    for (int f = 0; f < 2; ++f) {
      const Vec3<S>* a = axes[f];
      if (f == 1) torque += Cross(arm, force);
      const S x = Dot(torque, a[0]), y = Dot(torque, a[1]), w = Dot(torque, a[2]);
      const Vec3<S> on_x = Scaled(w, a[1]) - Scaled(y, a[2]);
      const Vec3<S> on_y = Scaled(x, a[2]);
      S* out = e + 9 * f;
      const double sign = f == 0 ? 1 : -1;
      for (int k = 0; k < 3; ++k) {
        out[k] = sign * (force(k) - on_x(k) - on_y(k));
        out[3 + k] = sign * on_x(k);
        out[6 + k] = sign * on_y(k);
      }
    }
  }

 private:
  template <class S>
  static Vec3<S> Between(const S* z, int to) {
    return Vec3<S>(z[to] - z[0], z[to + 1] - z[1], z[to + 2] - z[2]);
  }
  template <class F, class S>
  static Vec3<S> Scaled(const F& factor, const Vec3<S>& vector) {
    return Vec3<S>(factor * vector(0), factor * vector(1), factor * vector(2));
  }
};

}  // namespace effort
}  // namespace contact_flow
