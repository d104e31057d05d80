// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/model_system.h"
#include "src/model/example/soft_biped.h"
#include "test/friction/systems/contact_parameters.h"

namespace contact_flow {
namespace test {

/// The soft-leg biped with friction at its feet.
struct SoftBipedWithFriction : example::SoftBiped {
  static constexpr int kSlipDimension = 1;
  template <class P>
  struct Parameters : example::SoftBiped::Parameters<P>, ContactParameters<P> {
    template <class Visitor>
    void Visit(Visitor&& visit) {
      example::SoftBiped::Parameters<P>::Visit(visit);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 7, 1>&,
                   const Eigen::Matrix<S, 7, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(kFootX);
    (*s)(1) = v(kFootX + 1);
  }
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
