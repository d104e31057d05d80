// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <type_traits>

#include "contact_flow/constraint_set.h"
#include "contact_flow/model/configuration_space.h"

namespace contact_flow {

/// What a template model may leave out, with what is then understood (see model_system.h).
template <class Model>
class ModelTraits {
  template <class M, class = void>
  struct Positions : std::integral_constant<int, M::kDof> {};
  template <class M>
  struct Positions<M, std::void_t<decltype(M::kPositions)>>
      : std::integral_constant<int, M::kPositions> {};

  template <class M, class = void>
  struct Bilateral : std::integral_constant<int, 0> {};
  template <class M>
  struct Bilateral<M, std::void_t<decltype(M::kBilateral)>>
      : std::integral_constant<int, M::kBilateral> {};

  template <class M, class = void>
  struct Tangential : std::integral_constant<int, 0> {};
  template <class M>
  struct Tangential<M, std::void_t<decltype(M::kSlipDimension)>>
      : std::integral_constant<int, M::kConstraints * M::kSlipDimension> {};

  template <class M, class = void>
  struct ContactEffort : std::false_type {};
  template <class M>
  struct ContactEffort<M, std::void_t<decltype(M::kContactEffort)>>
      : std::integral_constant<bool, M::kContactEffort> {};

  template <class M, class = void>
  struct OfSpace {
    static ConfigurationSpace Get() { return ConfigurationSpace(M::kDof); }
  };
  template <class M>
  struct OfSpace<M, std::void_t<decltype(M::Space())>> {
    static ConfigurationSpace Get() { return M::Space(); }
  };

  template <class M, class = void>
  struct OfCompliant {
    static ConstraintSet Get() { return ConstraintSet(); }
  };
  template <class M>
  struct OfCompliant<M, std::void_t<decltype(M::Compliant())>> {
    static ConstraintSet Get() { return M::Compliant(); }
  };

 public:
  /// nq; kDof unless the model has kPositions.
  static constexpr int kPositions = Positions<Model>::value;
  /// l; 0 unless the model has kBilateral, kBilateralNames and Closures.
  static constexpr int kBilateral = Bilateral<Model>::value;
  /// r; 0 unless the model has kSlipDimension, Slip and Friction.
  static constexpr int kTangential = Tangential<Model>::value;
  /// Whether Force takes the contact mode; not unless kContactEffort is true.
  static constexpr bool kContactEffort = ContactEffort<Model>::value;
  /// ℝᵈ unless the model has Space().
  static ConfigurationSpace Space() { return OfSpace<Model>::Get(); }
  /// None unless the model has Compliant().
  static ConstraintSet Compliant() { return OfCompliant<Model>::Get(); }
};

}  // namespace contact_flow
