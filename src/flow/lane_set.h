// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/flow/simulate_batch.h"
#include "lanes.h"

namespace contact_flow {

/// The lanes that a system may have on this machine: a maker, one for all threads.
class LanesOfSystem {
 public:
  LanesOfSystem(const MechanicalSystem& system, const SimulateOptions& options, LaneSet set);

  bool available() const { return maker_ != nullptr; }
  /// Why there are none.
  const std::string& why() const { return why_; }
  std::unique_ptr<LaneStepper> Make() const;

 private:
  LaneStepperMaker maker_ = nullptr;
  Matrix jacobian_;
  std::vector<double> parameters_;
  std::string why_;
};

/// P_J and Λ_J A_J M⁻¹ of a mode [d×d], [n×d]: as ContactDynamics makes them of constant M and Da.
struct ModeMaps {
  ContactMode mode;
  Matrix inverse, force_map;
  Vector gain;  // G_ii of the members [n]
  bool regular = false;
};
ModeMaps MapsOfMode(const MechanicalSystem& system, const Vector& x, const Vector& u,
                    ContactMode mode);

}  // namespace contact_flow
