// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "contact_flow/autodiff.h"
#include "contact_flow/model/narrow_surfaces.h"
#include "contact_flow/model/rigid_body/element_parts.h"
#include "contact_flow/model/rigid_body/slip_kernel.h"

namespace contact_flow {

/// A constraint of a robot: a(z) ≥ 0 (or b(z) = 0), with z as in ElementParts. With g = ∂a/∂z and
/// the acceleration z̈, ä = g z̈ + żᵀ (∂²a/∂z²) ż. With friction it slips with s = W(z) ż, one row
/// for each tangential direction (SlipFrame), and z is longer: a depends on its
/// first `size` numbers.
class ConstraintElement {
 public:
  virtual ~ConstraintElement() = default;
  ElementParts parts;
  Parameter restitution = {"restitution", "", "share of the approach speed that returns", 0};
  Parameter friction = {"friction", "", "Coulomb's coefficient of friction", 0};
  bool no_slip = false;  ///< its friction is infinite
  SlipFrame slip;        ///< without friction it has no rows

  /// Whether two surfaces touch, at a place and with a normal.
  virtual bool Touches() const = 0;
  /// Whether it may have friction: surfaces that touch, and brakes.
  virtual bool MaySlip() const = 0;
  /// Takes the frame, and into `parts` what its slip depends on. MaySlip() only, and once.
  virtual void AddFriction(const SlipFrame& frame) = 0;
  /// Numbers that a depends on.
  virtual int size() const = 0;

  /// a is affine in z.
  virtual bool IsAffine() const = 0;
  virtual double Gap(const double* z, double* gradient) const = 0;
  /// żᵀ (∂²a/∂z²) ż.
  virtual double Curvature(const double* z, const double* rate) const = 0;
  /// λ ∂²a/∂z² [N×N], and the derivatives of ä by z and ż [N], z̈ fixed.
  virtual void Differentiate(const double* z, const double* rate, const double* acceleration,
                             double lambda, double* hessian, double* by_z,
                             double* by_rate) const = 0;
  struct ByNumber {
    double gap;
    double acceleration;  ///< of ä, z̈ fixed
  };
  /// Derivatives of a, ä and the gradient [N] by number k.
  virtual ByNumber DifferentiateByNumber(const double* z, const double* rate,
                                         const double* acceleration, int k,
                                         double* gradient) const = 0;

  /// W does not depend on z. The rest is of slip, too, as in SlipKernel.
  virtual bool IsSlipAffine() const = 0;
  virtual void SlipMap(const double* z, double* map) const = 0;
  virtual void SlipRate(const double* z, const double* rate, const double* acceleration,
                        double* slip_rate) const = 0;
  virtual void SlipHessian(const double* z, const double* lambda, double* hessian) const = 0;
  virtual void DifferentiateSlip(const double* z, const double* rate, const double* acceleration,
                                 double* rate_z, double* rate_rate, double* slip_z) const = 0;
  virtual void DifferentiateSlipByNumber(const double* z, const double* rate,
                                         const double* acceleration, int k, double* map,
                                         double* slip_rate) const = 0;
  /// From the first point to where it touches, in world axes, and the force there of λ = 1 along
  /// the normal. Touches() only.
  virtual void Place(const double* z, Vec3<double>* arm, Vec3<double>* push) const = 0;

  /// Coordinates across its surface, for each the values at which ∂³a jumps, ascending
  /// (SplineKnots); and those coordinates at z.
  virtual std::vector<std::vector<double>> Knots() const { return {}; }
  virtual void Across(const double* /*z*/, double* /*coordinates*/) const {}
  /// Whether its surface may be narrow (NarrowSurfaces); and how it is passed at z with ż.
  virtual bool IsNarrow() const { return false; }
  virtual SurfacePassage Passage(const double* /*z*/, const double* /*rate*/) const { return {}; }
  /// The first time of the robot's clock behind t at which a derivative of its motion jumps.
  virtual double NextKnot(double /*t*/) const { return std::numeric_limits<double>::infinity(); }
};

/// Whether a kind has Knots(parts) and Across(parts, z, coordinates).
template <class Kind, class = void>
struct HasKnots : std::false_type {};
template <class Kind>
struct HasKnots<Kind, std::void_t<decltype(&Kind::Knots)>> : std::true_type {};

/// Whether a kind has Passage(parts, z, rate).
template <class Kind, class = void>
struct HasPassage : std::false_type {};
template <class Kind>
struct HasPassage<Kind, std::void_t<decltype(&Kind::Passage)>> : std::true_type {};

/// A constraint from a kind written once as a template. `Kind` provides (see constraint/plane.h):
///   kName                            what YAML calls it
///   kPoints, kJoints, kNumbers       how many of each
///   kAffine                          a promise that saves work
///   Read(fields)                     asks for its fields, in the order of the numbers
///   Gap(number, z)                   for any scalar, smooth where it vanishes
///   kTouches                         whether surfaces touch: then what SlipKernel asks for
///   Knots, Across                    where ∂³a jumps (ConstraintElement), if it does
///   Passage                          where its surface may be narrow (ConstraintElement)
///   kTable, if it needs parts.heights: Gap and At then have them as an argument before all others
template <class Kind>
class ConstraintOf final : public ConstraintElement {
  static constexpr int N = 3 * Kind::kPoints + Kind::kJoints;
  static constexpr bool kSlips = Kind::kTouches || std::is_same_v<Kind, constraint::Brake>;

 public:
  bool IsAffine() const override { return Kind::kAffine; }
  bool Touches() const override { return Kind::kTouches; }
  bool MaySlip() const override { return kSlips; }
  int size() const override { return N; }

  double Gap(const double* z, double* gradient) const override {
    using S = Dual<double, N>;
    std::array<S, N> Z;
    for (int k = 0; k < N; ++k) Z[k] = S::Variable(z[k], k);
    const S a = GapOf(Numbers<S>().data(), Z.data());
    for (int k = 0; k < N; ++k) gradient[k] = a.d[k];
    return a.value;
  }

  double Curvature(const double* z, const double* rate) const override {
    if (Kind::kAffine) return 0;
    const double still[N] = {};
    return Second(Numbers<Along<double>>(), z, rate, still);
  }

  void Differentiate(const double* z, const double* rate, const double* acceleration, double lambda,
                     double* hessian, double* by_z, double* by_rate) const override {
    for (int k = 0; k < N * N; ++k) hessian[k] = 0;
    for (int k = 0; k < N; ++k) by_z[k] = by_rate[k] = 0;
    if constexpr (!Kind::kAffine) {
      using B = Dual<double, N>;
      using S = Dual<B, N>;
      std::array<S, N> Z;
      for (int k = 0; k < N; ++k) Z[k] = S::Variable(B::Variable(z[k], k), k);
      const S a = GapOf(Numbers<S>().data(), Z.data());
      for (int i = 0; i < N; ++i) {
        for (int k = 0; k < N; ++k) hessian[i + k * N] = lambda * a.d[i].d[k];
      }
      using C = Dual<double, 2 * N>;
      std::array<C, N> at, along, bend;
      for (int k = 0; k < N; ++k) {
        at[k] = C::Variable(z[k], k);
        along[k] = C::Variable(rate[k], N + k);
        bend[k] = C(acceleration[k]);
      }
      const C second = Second(Numbers<Along<C>>(), at.data(), along.data(), bend.data());
      for (int k = 0; k < N; ++k) by_z[k] = second.d[k];
      for (int k = 0; k < N; ++k) by_rate[k] = second.d[N + k];
    }
  }

  ByNumber DifferentiateByNumber(const double* z, const double* rate, const double* acceleration,
                                 int number, double* gradient) const override {
    using B = Dual<double, 1>;
    using S = Dual<B, N>;
    std::array<S, N> Z;
    std::array<B, N> at, along, bend;
    for (int k = 0; k < N; ++k) {
      Z[k] = S::Variable(B(z[k]), k);
      at[k] = B(z[k]);
      along[k] = B(rate[k]);
      bend[k] = B(acceleration[k]);
    }
    auto numbers = Numbers<S>();
    numbers[number].value.d[0] = 1;
    auto second_numbers = Numbers<Along<B>>();
    second_numbers[number].value.value.d[0] = 1;
    const S a = GapOf(numbers.data(), Z.data());
    for (int k = 0; k < N; ++k) gradient[k] = a.d[k].d[0];
    return {a.value.d[0], Second(second_numbers, at.data(), along.data(), bend.data()).d[0]};
  }

  void AddFriction(const SlipFrame& frame) override {
    slip = frame;
    if constexpr (Kind::kTouches) {
      if constexpr (Kind::kTips > 0) parts.points.push_back(Kind::Tip(parts));
      if constexpr (Kind::kTurns > 0) parts.turns.push_back(parts.points[0].body);
      if constexpr (Kind::kTurns > 1) parts.turns.push_back(parts.points[Kind::kOther].body);
    }
  }
  bool IsSlipAffine() const override {
    if constexpr (Kind::kTouches) return Kind::kSlipAffine;
    return true;
  }
  void SlipMap(const double* z, double* map) const override {
    if constexpr (kSlips) SlipKernel<Kind>::Map(slip, parts, z, map);
  }
  void SlipRate(const double* z, const double* rate, const double* acceleration,
                double* slip_rate) const override {
    if constexpr (kSlips) {
      SlipKernel<Kind>::Rate(slip, parts, z, rate, acceleration, slip_rate);
    }
  }
  void SlipHessian(const double* z, const double* lambda, double* hessian) const override {
    if constexpr (kSlips) SlipKernel<Kind>::Hessian(slip, parts, z, lambda, hessian);
  }
  void DifferentiateSlip(const double* z, const double* rate, const double* acceleration,
                         double* rate_z, double* rate_rate, double* slip_z) const override {
    if constexpr (kSlips) {
      SlipKernel<Kind>::Differentiate(slip, parts, z, rate, acceleration, rate_z, rate_rate,
                                      slip_z);
    }
  }
  void DifferentiateSlipByNumber(const double* z, const double* rate, const double* acceleration,
                                 int k, double* map, double* slip_rate) const override {
    if constexpr (kSlips) {
      SlipKernel<Kind>::ByNumber(slip, parts, z, rate, acceleration, k, map, slip_rate);
    }
  }
  void Place(const double* z, Vec3<double>* arm, Vec3<double>* push) const override {
    if constexpr (Kind::kTouches) {
      const constraint::Touch<double> touch = TouchOf<Kind>(parts, Numbers<double>().data(), z);
      *arm = touch.arm;
      *push = touch.stretch * touch.normal;
    }
  }

  std::vector<std::vector<double>> Knots() const override {
    if constexpr (HasKnots<Kind>::value) return Kind::Knots(parts);
    return {};
  }
  void Across(const double* z, double* coordinates) const override {
    if constexpr (HasKnots<Kind>::value) Kind::Across(parts, z, coordinates);
  }
  bool IsNarrow() const override { return HasPassage<Kind>::value; }
  SurfacePassage Passage(const double* z, const double* rate) const override {
    if constexpr (HasPassage<Kind>::value) return Kind::Passage(parts, z, rate);
    return {};
  }

 private:
  template <class S>
  S GapOf(const S* number, const S* z) const {
    if constexpr (HasTable<Kind>::value) {
      return Kind::Gap(*parts.heights, number, z);
    } else {
      return Kind::Gap(number, z);
    }
  }
  /// Two directions nested, for d²/ds².
  template <class S>
  using Along = Dual<Dual<S, 1>, 1>;

  template <class S>
  std::array<S, Kind::kNumbers + 1> Numbers() const {
    std::array<S, Kind::kNumbers + 1> numbers;
    for (int k = 0; k < Kind::kNumbers; ++k) numbers[k] = S(parts.numbers[k].value);
    return numbers;
  }

  /// d²/ds² a(z + s ż + ½ s² z̈) at s = 0.
  template <class S>
  S Second(const std::array<Along<S>, Kind::kNumbers + 1>& numbers, const S* z, const S* rate,
           const S* acceleration) const {
    std::array<Along<S>, N> Z;
    for (int k = 0; k < N; ++k) {
      Z[k].value.value = z[k];
      Z[k].value.d[0] = rate[k];
      Z[k].d[0].value = rate[k];
      Z[k].d[0].d[0] = acceleration[k];
    }
    return GapOf(numbers.data(), Z.data()).d[0].d[0];
  }
};

std::vector<std::string> ConstraintKinds();
/// A constraint of a kind without parts, and what asks for its fields. Throws
/// std::invalid_argument, with the nearest name, for an unknown kind.
std::unique_ptr<ConstraintElement> MakeConstraint(const std::string& kind);
void ReadConstraint(const std::string& kind, ElementFields* fields);
/// b = direction · (point − other point), the direction in world axes: a row of a loop closure.
std::unique_ptr<ConstraintElement> MakeClosureRow(const AttachedPoint& point,
                                                  const AttachedPoint& other, int axis);
/// The same, the direction that from the other point to `tip`, a unit away and fixed in its link.
std::unique_ptr<ConstraintElement> MakeClosureRow(const AttachedPoint& point,
                                                  const AttachedPoint& other,
                                                  const AttachedPoint& tip);
/// b = q − multiplier q_master − offset: a joint that follows another.
std::unique_ptr<ConstraintElement> MakeFollower(const RobotModel::Coordinate& joint,
                                                const RobotModel::Coordinate& master,
                                                double multiplier, double offset);
/// Coulomb friction of a joint, by a pad whose only force presses it down with 1 (Brake).
std::unique_ptr<ConstraintElement> MakeBrake(const RobotModel::Coordinate& joint,
                                             const RobotModel::Coordinate& pad);

}  // namespace contact_flow
