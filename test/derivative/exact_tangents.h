// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <boost/numeric/odeint.hpp>
#include <vector>

#include "test/derivative/localized_forces.h"

namespace contact_flow {
namespace test {

struct ExactTangents {
  Vector x;    ///< final state [nq+d]
  Matrix phi;  ///< its derivative by (δq, δv) and all parameters [2d × 2d+k]
};

/// State and variational equation together, by Boost's fehlberg78 at 1e-13 with steps of at most
/// duration/steps: nothing of the code under test takes part.
inline ExactTangents IntegrateTangents(const LocalizedForces& system, const Vector& x,
                                       double duration, int steps) {
  using State = std::vector<double>;
  const int nq = system.num_positions(), d = system.dof(), n = nq + d;
  const int columns = 2 * d + static_cast<int>(system.description().parameters.size());
  State y(static_cast<std::size_t>(n + 2 * d * columns), 0.0);
  Eigen::Map<Vector>(y.data(), n) = x;
  Eigen::Map<Matrix>(y.data() + n, 2 * d, columns).leftCols(2 * d).setIdentity();
  Vector f;
  Matrix by_x, by_p;
  const auto field = [&](const State& at, State& rate, double) {
    const Vector now = Eigen::Map<const Vector>(at.data(), n);
    system.Force(now, &f, &by_x, &by_p);
    const Matrix N = system.Rates(now.head(nq));
    Eigen::Map<Vector>(rate.data(), nq) = N * now.tail(d);
    Eigen::Map<Vector>(rate.data() + nq, d) = f;
    const Eigen::Map<const Matrix> W(at.data() + n, 2 * d, columns);
    Eigen::Map<Matrix> dW(rate.data() + n, 2 * d, columns);
    dW.topRows(d) = W.bottomRows(d) - system.space().Bracket(now.tail(d)) * W.topRows(d);
    dW.bottomRows(d) = by_x.leftCols(nq) * N * W.topRows(d) + by_x.rightCols(d) * W.bottomRows(d);
    dW.bottomRightCorner(d, by_p.cols()) += by_p;
  };
  namespace odeint = boost::numeric::odeint;
  const auto stepper =
      odeint::make_controlled(1e-13, 1e-13, odeint::runge_kutta_fehlberg78<State>());
  const double h = duration / steps;
  for (int k = 0; k < steps; ++k) {
    odeint::integrate_adaptive(stepper, field, y, k * h, (k + 1) * h, h);
  }
  return {Eigen::Map<Vector>(y.data(), n), Eigen::Map<Matrix>(y.data() + n, 2 * d, columns)};
}

}  // namespace test
}  // namespace contact_flow
