// SPDX-License-Identifier: BSD-3-Clause
#include "surface_motion.h"

#include <cmath>
#include <limits>

namespace contact_flow {

std::vector<Parameter> SurfaceMotion::Numbers() {
  return {{"motion_direction_x", "", "of the motion of the surface", 0},
          {"motion_direction_y", "", "of the motion of the surface", 0},
          {"motion_direction_z", "", "of the motion of the surface", 1},
          {"motion_velocity", "m/s", "of the surface along its direction", 0},
          {"motion_amplitude", "m", "of the sinusoid along it", 0},
          {"motion_frequency", "Hz", "of the sinusoid", 0},
          {"motion_phase", "rad", "of the sinusoid at time zero", 0}};
}

void SurfaceMotion::Sample(const std::vector<double>& times, const std::vector<double>& values,
                           bool periodic) {
  // Checked alike. At rest at its ends a TimeFunction has jumps of r̈, which are jumps of force.
  auto lap =
      std::make_shared<const TimeFunction>(TimeFunction::Kind::kCubic, times, values, periodic);
  if (periodic) {
    lap_ = lap;
  } else {
    line_ = std::make_shared<const NaturalSpline>(times, values);
  }
}

double SurfaceMotion::NextKnot(double t) const {
  if (lap_) return lap_->NextKnot(t);
  return line_ ? line_->NextKnot(t) : std::numeric_limits<double>::infinity();
}

template <class S>
Vec3<S> SurfaceMotion::Displacement(const std::array<S, kNumbers>& number, const S& t) const {
  using std::sin;
  S along = number[3] * t + number[4] * sin(2 * M_PI * number[5] * t + number[6]);
  if (lap_) {
    S value, rate;
    lap_->At(t, 0, &value, &rate);
    along = along + value;
  }
  if (line_) along = along + line_->At(t);
  const Vec3<S> d = constraint::UnitAlong(number.data());
  return Vec3<S>(d(0) * along, d(1) * along, d(2) * along);
}

Vec3<double> SurfaceMotion::Direction() const { return constraint::UnitAlong(number_.data()); }

std::array<Vec3<double>, 4> SurfaceMotion::At(double t) const {
  using First = Dual<double, 1>;
  using Second = Dual<First, 1>;
  using Third = Dual<Second, 1>;
  std::array<Third, kNumbers> number;
  for (std::size_t k = 0; k < number.size(); ++k) number[k] = Third(number_[k]);
  const Vec3<Third> s =
      Displacement(number, Third::Variable(Second::Variable(First::Variable(t, 0), 0), 0));
  std::array<Vec3<double>, 4> at;
  for (int k = 0; k < 3; ++k) {
    at[0](k) = s(k).value.value.value;
    at[1](k) = s(k).value.value.d[0];
    at[2](k) = s(k).value.d[0].d[0];
    at[3](k) = s(k).d[0].d[0].d[0];
  }
  return at;
}

std::array<Vec3<double>, 3> SurfaceMotion::ByNumber(double t, int k) const {
  using Change = Dual<double, 1>;
  using First = Dual<Change, 1>;
  using Second = Dual<First, 1>;
  std::array<Second, kNumbers> number;
  for (std::size_t i = 0; i < number.size(); ++i) number[i] = Second(number_[i]);
  number[static_cast<std::size_t>(k)].value.value.d[0] = 1;
  const Vec3<Second> s = Displacement(number, Second::Variable(First::Variable(Change(t), 0), 0));
  std::array<Vec3<double>, 3> by;
  for (int i = 0; i < 3; ++i) {
    by[0](i) = s(i).value.value.d[0];
    by[1](i) = s(i).value.d[0].d[0];
    by[2](i) = s(i).d[0].d[0].d[0];
  }
  return by;
}

}  // namespace contact_flow
