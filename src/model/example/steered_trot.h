// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "hopping_trot.h"

namespace contact_flow {
namespace example {

/// hopping_trot with a flywheel in its body that may be driven: its torque on the body's pitch is
/// the input. Without it the motions are those of hopping_trot.
struct SteeredTrot : HoppingTrot {
  static constexpr const char* kName = "steered_trot";
  static constexpr const char* kSummary = "hopping_trot with a torque on its body as input";
  static constexpr int kInputs = 1;
  static constexpr std::array<const char*, 1> kInputNames = {"pitch_torque"};

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 7, 1>& q,
                    const Eigen::Matrix<S, 7, 1>& v, const Eigen::Matrix<S, 1, 1>& u,
                    Eigen::Matrix<S, 7, 1>* f) {
    HoppingTrot::Force(p, q, v, Eigen::Matrix<S, 0, 1>(), f);
    (*f)(kPitch) += u(0);
  }

  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run = HoppingTrot::Nominal(p);
    run.u = Vector::Zero(1);
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
