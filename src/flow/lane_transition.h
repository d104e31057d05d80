// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/flow/transition.h"

namespace contact_flow {

/// Plastic touchdowns of one contact, by what does not change from one to the next where M and Da
/// are constant.
class PlasticTouchdown {
 public:
  explicit PlasticTouchdown(const MechanicalSystem& system);

  /// What ResolveTransition gives, to the bit, but for the obstacle, the instants and the tolerance
  /// of the transition; nothing where the cluster is not clearly of this kind.
  std::optional<ResolvedTransition> Resolve(ContactDynamics* dynamics, double t, const Vector& x,
                                            ContactMode mode, int trigger,
                                            const TransitionRules& rules);

 private:
  /// Of a set of contacts.
  struct Contacts {
    ConstraintSet set;
    Matrix rows, delassus;
  };
  const Contacts& Of(ConstraintSet set);
  bool IsAlone(ContactDynamics* dynamics, const Vector& x, ContactMode mode, int trigger,
               const TransitionRules& rules);
  bool Press(const Contacts& contacts, const Vector& u, const Vector& x);
  double Rounding(int i, const VectorRef& v) const;

  const MechanicalSystem& system_;
  const InverseInertia inertia_;
  std::vector<Contacts> known_;
  ConstraintTerms terms_;
  Vector rate_, applied_, x_plus_;
};

}  // namespace contact_flow
