// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "contact_flow/autodiff.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {

/// A force element of a robot: e(z, ż, u) [N], with z as in ElementParts and e conjugate to it,
/// that is the force on each point in world axes [N] and the effort on each joint [N or N·m]. The
/// generalized force is (∂z/∂η)ᵀ e. Where it follows a reference u has one number more: how many
/// of its switches lie behind.
class EffortElement {
 public:
  virtual ~EffortElement() = default;
  ElementParts parts;

  virtual void Evaluate(const double* z, const double* rate, const double* u, double* e) const = 0;
  /// e and its derivatives, column-major: by z and ż [N×N], by u [N×U].
  virtual void Differentiate(const double* z, const double* rate, const double* u, double* e,
                             double* by_z, double* by_rate, double* by_u) const = 0;
  /// ∂e/∂(number k) [N].
  virtual void DifferentiateByNumber(const double* z, const double* rate, const double* u, int k,
                                     double* by_number) const = 0;
  /// Whether the effort e₀ itself is limited, and whether the speed of its joint limits it.
  virtual bool HasLimit() const { return false; }
  virtual bool HasSpeedLimit() const { return false; }
  /// What passes ±1 where e₀ reaches these limits, and leaves them (see EffortOf).
  virtual double Share(const double* /*z*/, const double* /*rate*/, const double* /*u*/) const {
    return 0;
  }
  virtual double SpeedShare(const double* /*z*/, const double* /*rate*/,
                            const double* /*u*/) const {
    return 0;
  }
};

/// Which of the optional members below a kind has.
template <class Kind, class = void>
struct FollowsReference : std::false_type {};
template <class Kind>
struct FollowsReference<Kind, std::void_t<decltype(Kind::kFollows)>> : std::true_type {};
template <class Kind, class = void>
struct LimitsOf : std::integral_constant<int, -1> {};
template <class Kind>
struct LimitsOf<Kind, std::void_t<decltype(Kind::kLimits)>>
    : std::integral_constant<int, Kind::kLimits> {};

/// An element from a kind written once as a template. `Kind` provides (see effort/joint_spring.h):
///   kName                                     what YAML calls it
///   kPoints, kJoints, kInputs, kNumbers       how many of each
///   Read(fields)                              asks for its fields, in the order of the numbers
///   Effort(number, z, ż, u, e)                for any scalar
///   kFollows, if it follows a reference r: the last joint is the clock, on which e is zero; and u
///                                             goes on with r and ∂r/∂clock
///   kLimits, if it saturates: the first of ElementFields::Limits. With f the effort without them
///                                             e₀ is f between the lines ± stall − stall q̇/speed,
///                                             then within ± limit. e is continuous there, and
///                                             where it passes the integrator ends a step
///                                             (EffortLimits); derivatives right on a limit are
///                                             those of the side within it
template <class Kind>
class EffortOf final : public EffortElement {
  static constexpr int N = 3 * Kind::kPoints + Kind::kJoints;
  static constexpr int U = Kind::kInputs;
  static constexpr bool kFollows = FollowsReference<Kind>::value;
  static constexpr int kLimits = LimitsOf<Kind>::value;
  static constexpr double kUnlimited = ElementFields::kUnlimited;
  /// An effort is on a bound within this part of the room between both: its rounding.
  static constexpr double kOnBound = std::numeric_limits<double>::epsilon();

 public:
  void Evaluate(const double* z, const double* rate, const double* u, double* e) const override {
    double number[Kind::kNumbers];
    Free(z, rate, u, number, e);
    Saturate(number, rate, e);
  }

  bool HasLimit() const override { return IsGiven(0); }
  bool HasSpeedLimit() const override { return IsGiven(1); }

  /// Of f between the lines: e₀ over its limit.
  double Share(const double* z, const double* rate, const double* u) const override {
    if constexpr (kLimits >= 0) {
      double number[Kind::kNumbers], e[N];
      Free(z, rate, u, number, e);
      KeepBetweenLines(number, rate, e);
      return e[0] / number[kLimits];
    }
    return EffortElement::Share(z, rate, u);
  }
  /// Of f within ± limit: e₀/stall + q̇/speed.
  double SpeedShare(const double* z, const double* rate, const double* u) const override {
    if constexpr (kLimits >= 0) {
      double number[Kind::kNumbers], e[N];
      Free(z, rate, u, number, e);
      Keep(-number[kLimits], number[kLimits], e);
      return e[0] / Stall(number) + rate[0] / number[kLimits + 1];
    }
    return EffortElement::SpeedShare(z, rate, u);
  }

  void Differentiate(const double* z, const double* rate, const double* u, double* e, double* by_z,
                     double* by_rate, double* by_u) const override {
    using S = Dual<double, 2 * N + U>;
    S number[Kind::kNumbers], Z[N], R[N], W[U + 2] = {}, E[N];
    for (int k = 0; k < Kind::kNumbers; ++k) number[k] = S(parts.numbers[k].value);
    for (int k = 0; k < N; ++k) Z[k] = S::Variable(z[k], k);
    for (int k = 0; k < N; ++k) R[k] = S::Variable(rate[k], N + k);
    for (int k = 0; k < U; ++k) W[k] = S::Variable(u[k], 2 * N + k);
    Refer(Z[N - 1], u, W);
    Kind::Effort(number, Z, R, W, E);
    if (kFollows) E[N - 1] = S(0.0);
    Saturate(number, R, E);
    for (int i = 0; i < N; ++i) {
      e[i] = E[i].value;
      for (int k = 0; k < N; ++k) by_z[i + k * N] = E[i].d[k];
      for (int k = 0; k < N; ++k) by_rate[i + k * N] = E[i].d[N + k];
      for (int k = 0; k < U; ++k) by_u[i + k * N] = E[i].d[2 * N + k];
    }
  }

  void DifferentiateByNumber(const double* z, const double* rate, const double* u, int k,
                             double* by_number) const override {
    using S = Dual<double, 1>;
    S number[Kind::kNumbers], Z[N], R[N], W[U + 2] = {}, E[N];
    for (int i = 0; i < Kind::kNumbers; ++i) number[i] = S(parts.numbers[i].value);
    number[k].d[0] = 1;
    for (int i = 0; i < N; ++i) Z[i] = S(z[i]);
    for (int i = 0; i < N; ++i) R[i] = S(rate[i]);
    for (int i = 0; i < U; ++i) W[i] = S(u[i]);
    Refer(Z[N - 1], u, W);
    Kind::Effort(number, Z, R, W, E);
    if (kFollows) E[N - 1] = S(0.0);
    Saturate(number, R, E);
    for (int i = 0; i < N; ++i) by_number[i] = E[i].d[0];
  }

 private:
  /// The numbers, and e as if it had no limit.
  void Free(const double* z, const double* rate, const double* u, double* number, double* e) const {
    for (int k = 0; k < Kind::kNumbers; ++k) number[k] = parts.numbers[k].value;
    if constexpr (kFollows) {
      double w[U + 2];
      std::copy_n(u, U, w);
      Refer(z[N - 1], u, w);
      Kind::Effort(number, z, rate, w, e);
      e[N - 1] = 0;
    } else {
      Kind::Effort(number, z, rate, u, e);
    }
  }
  /// Whether number k of its limits, if it has any, is one.
  bool IsGiven(int k) const {
    return kLimits >= 0 && parts.numbers[kLimits + k].value < kUnlimited;
  }
  /// The effort at standstill: `stall`, or the limit.
  template <class S>
  static const S& Stall(const S* number) {
    const S& stall = number[kLimits + 2];
    return stall < S(kUnlimited) ? stall : number[kLimits];
  }
  static void SetValue(double value, double* x) { *x = value; }
  template <int K>
  static void SetValue(const Dual<double, K>& value, Dual<double, K>* x) {
    x->value = value.value;
  }
  /// Keeps e₀ in [low, high]; on a bound with its own derivatives.
  template <class S>
  static void Keep(const S& low, const S& high, S* e) {
    if (e[0] < high && low < e[0]) return;
    const S& bound = low < e[0] ? high : low;
    const S width = kOnBound * (high - low);
    if (e[0] - high <= width && low - e[0] <= width) {
      SetValue(bound, e);
    } else {
      e[0] = bound;
    }
  }
  template <class S>
  static void KeepBetweenLines(const S* number, const S* rate, S* e) {
    if (!(number[kLimits + 1] < S(kUnlimited))) return;
    const S& stall = Stall(number);
    const S lost = stall * (rate[0] / number[kLimits + 1]);
    Keep(S(-stall - lost), S(stall - lost), e);
  }
  template <class S>
  static void Saturate(const S* number, const S* rate, S* e) {
    if constexpr (kLimits >= 0) {
      KeepBetweenLines(number, rate, e);
      Keep(S(-number[kLimits]), number[kLimits], e);
    }
  }
  /// r and ∂r/∂clock behind the inputs.
  template <class S>
  void Refer(const S& clock, const double* u, S* w) const {
    if constexpr (kFollows) {
      parts.reference->At(clock, static_cast<int>(u[U]), &w[U], &w[U + 1]);
    }
  }
};

std::vector<std::string> EffortKinds();
/// An element of a kind without parts, and what asks for its fields. Throws std::invalid_argument,
/// with the nearest name, for an unknown kind.
std::unique_ptr<EffortElement> MakeEffort(const std::string& kind);
void ReadEffort(const std::string& kind, ElementFields* fields);

}  // namespace contact_flow
