// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/model_system.h"
#include "src/model/example/puck.h"
#include "test/friction/systems/contact_parameters.h"

namespace contact_flow {
namespace test {

/// With friction and restitution of a reference run.
struct Puck : example::Puck {
  static constexpr const char* kName = "test_puck";
  template <class P>
  struct Parameters : example::Puck::Parameters<P>, ContactParameters<P> {
    template <class Visitor>
    void Visit(Visitor&& visit) {
      example::Puck::Parameters<P>::Visit(visit);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P>
  static P Friction(const Parameters<P>& p, int i) {
    return p.Mu(i);
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return p.Gamma(i);
  }
};

}  // namespace test
}  // namespace contact_flow
