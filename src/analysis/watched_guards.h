// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The Guards of one contact mode of a system with friction, and |T v| of what slips in space,
/// with what changes where one of them vanishes.
class WatchedGuards {
 public:
  struct Guard {
    int number;  ///< as in Guards
    int constraint;
    ValidityRadius::Limit limit;
  };
  struct Values {
    Vector value, rate;  ///< h, and dh/dt along the mode
    Matrix gradient;     ///< Dh [· × 2d+k]
    Vector field;        ///< of the mode [2d+k]
    double force = 0;    ///< the largest force
  };

  /// At x; `dynamics` must outlive it.
  WatchedGuards(ContactDynamics* dynamics, const VectorRef& x, ContactMode mode);

  const std::vector<Guard>& guards() const { return guards_; }
  Values At(const VectorRef& x) const;

 private:
  ContactDynamics& dynamics_;
  const MechanicalSystem& system_;
  const ContactMode mode_;
  const Guards numbers_;
  std::vector<Guard> guards_;
};

}  // namespace contact_flow
