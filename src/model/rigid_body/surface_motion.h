// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "contact_flow/model/parameter_values.h"
#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/time_function.h"
#include "src/model/natural_spline.h"

namespace contact_flow {

/// How a surface moves with the time t of the robot's clock, without turning: it is displaced by
///   s(t) = d/|d| (velocity t + amplitude sin(2π frequency t + phase) + r(t)),
/// r the spline through samples, or 0. s has continuous second derivatives.
class SurfaceMotion {
 public:
  static constexpr int kNumbers = 7;  ///< d, velocity, amplitude, frequency, phase
  /// Their names, units and meanings, at rest along z.
  static std::vector<Parameter> Numbers();

  /// Samples at times that rise; periodic ones end where they begin. Others go straight on at both
  /// ends. Throws std::invalid_argument for what is none of this.
  void Sample(const std::vector<double>& times, const std::vector<double>& values, bool periodic);
  void SetNumber(int k, double value) { number_[static_cast<std::size_t>(k)] = value; }

  /// Without acceleration, ever.
  bool IsUniform() const { return number_[4] == 0 && !lap_ && !line_; }
  /// The first time behind t at which a derivative of s̈ jumps, or infinity.
  double NextKnot(double t) const;
  /// d/|d|.
  Vec3<double> Direction() const;
  /// s, ṡ, s̈ and its derivative.
  std::array<Vec3<double>, 4> At(double t) const;
  /// The derivatives of s, ṡ and s̈ by number k.
  std::array<Vec3<double>, 3> ByNumber(double t, int k) const;

 private:
  template <class S>
  Vec3<S> Displacement(const std::array<S, kNumbers>& number, const S& t) const;

  std::array<double, kNumbers> number_ = {0, 0, 1, 0, 0, 0, 0};
  std::shared_ptr<const TimeFunction> lap_;    // of periodic samples
  std::shared_ptr<const NaturalSpline> line_;  // of others
};

}  // namespace contact_flow
