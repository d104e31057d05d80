// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/model_system.h"

namespace contact_flow {
namespace test {

/// Parameters that all systems here have: mu_i < 0 stands for no slip.
template <class P>
struct ContactParameters {
  P mu0 = 1, mu1 = 1, gamma0 = 0, gamma1 = 0;

  template <class Visitor>
  void Visit(Visitor&& visit) {
    visit(mu0, "mu0", "", "friction of the first contact", Range::kAny);
    visit(mu1, "mu1", "", "friction of the second contact", Range::kAny);
    visit(gamma0, "gamma0", "", "restitution of the first contact", Range::kUnitInterval);
    visit(gamma1, "gamma1", "", "restitution of the second contact", Range::kUnitInterval);
  }
  P Mu(int i) const {
    const P mu = i == 0 ? mu0 : mu1;
    return mu < P(0.0) ? P(contact_flow::Friction::kNoSlip) : mu;
  }
  P Gamma(int i) const { return i == 0 ? gamma0 : gamma1; }
};

}  // namespace test
}  // namespace contact_flow
