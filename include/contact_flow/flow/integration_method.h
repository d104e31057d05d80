// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace contact_flow {

/// How the motion between events is integrated.
enum class IntegrationMethod {
  /// DOP853, of order 8: steps for accuracy, and for stability where forces are stiff. Behind a
  /// slip in space that has only just begun steps are implicit, too, as long as it turns quickly.
  kExplicit,
  /// Radau IIA of 5 stages and order 9, L-stable: steps for accuracy alone, each at the cost of
  /// about three explicit ones and a Jacobian.
  kImplicit,
  /// Begins with the explicit one, goes over to the implicit one while stability limits its steps,
  /// and back.
  kAutomatic
};

}  // namespace contact_flow
