// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/types.h"

namespace contact_flow {

class InverseInertia;

/// No contact mode, or more than one, fits a state: the motion would slide on a switching surface,
/// or is not unique (Filippov).
struct UndecidedMode : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Which forces count as those that vanish now: those that do so within a time at their present
/// rates, and of some those alone that are small enough.
struct ForceTolerance {
  double within = 0;                        ///< [s]
  ConstraintSet bounded = ConstraintSet();  ///< these only
  const Vector* largest = nullptr;          ///< up to that [n], which outlives this

  double Of(int i, double rate) const {
    const double soon = within * std::abs(rate);
    return bounded.Contains(i) ? std::min(soon, (*largest)(i)) : soon;
  }
};

/// A contact mode, and what was not decided by forces alone.
struct ModeSelection {
  ContactMode mode;
  /// Candidates that neither press nor open, up to the first time derivative of both.
  ConstraintSet degenerate;
  /// Candidates that neither press nor open because they cannot: their rows of Da are dependent on
  /// those of the mode.
  ConstraintSet implied;
};

/// The contact mode of a state among the rigid candidates C = {i : a_i = 0, Da_i v = 0} (Sec. 2),
/// beside the `pressed` compliant ones: the support of
///   0 ≤ λ ⟂ ä = Da v̇ + Ḋa v ≥ 0,
/// together with `pressed`. Let α be the members that press, and β those whose force and normal
/// acceleration both vanish, within the tolerance. The rates decide on β, all at once: with the
/// Schur complement G̃ = G_ββ − G_βα G_αα⁻¹ G_αβ,
///   0 ≤ dλ_β/dt ⟂ d³a_β/dt³ = G̃ dλ_β/dt + c ≥ 0,   c_i = −G̃_ii (dλ_i/dt in mode α ∪ {i});
/// members with dλ_i/dt > 0 hold. For one constraint: it holds iff dλ_i/dt > 0 in the mode with
/// it. Where both vanish again, the second derivative of λ_i in the mode with i does.
/// Where rows of Da are dependent, the mode is an independent subset of rows with forces λ ≥ 0; it
/// spans the others that neither press nor open, so that the motion is that of all of them.
/// Where the effort depends on the mode, the one J ⊂ C with λ_J ≥ 0 and ä_{C∖J} ≥ 0 in its own
/// field is looked for; throws UndecidedMode when none or several fit, or no forces do.
/// `inertia` is that at q, at any velocity, where it is at hand.
ModeSelection SelectMode(ContactDynamics* dynamics, const VectorRef& x,
                         const ConstraintSet& candidates, const ForceTolerance& tolerance,
                         const ConstraintSet& pressed = ConstraintSet(),
                         const InverseInertia* inertia = nullptr);
/// Its mode alone.
ContactMode SelectContactMode(ContactDynamics* dynamics, const VectorRef& x,
                              const ConstraintSet& candidates, const ForceTolerance& tolerance,
                              const ConstraintSet& pressed = ConstraintSet());
/// The same beside contacts of a mode, which keep their letters.
ContactMode SelectContactMode(ContactDynamics* dynamics, const VectorRef& x,
                              const ConstraintSet& candidates, const ForceTolerance& tolerance,
                              const ContactMode& beside);

}  // namespace contact_flow
