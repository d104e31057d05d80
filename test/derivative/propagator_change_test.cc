// SPDX-License-Identifier: BSD-3-Clause
#include "src/derivative/propagator_change.h"

#include <gtest/gtest.h>

#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "src/model/example/puck.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

constexpr double kSlides = 0.2;  // [s]

/// Of a puck that slides and does not stop.
Trajectory SlideOf(const MechanicalSystem& puck, const Vector& x) {
  SimulateOptions options = test::Tight();
  options.dense = true;
  return Simulate(puck, x, Vector(0), kSlides, options);
}

/// Propagators of `count` parts of the slide from x.
std::vector<ArcPart> PartsOf(const MechanicalSystem& puck, const Vector& x, int count) {
  const Trajectory run = SlideOf(puck, x);
  EXPECT_EQ(1u, run.arcs.size());
  ContactDynamics dynamics(puck, Vector(0));
  std::vector<ArcPart> parts;
  for (int l = 0; l < count; ++l) {
    Arc slice = run.arcs.front();
    slice.t_begin = l * kSlides / count;
    slice.t_end = (l + 1) * kSlides / count;
    slice.dense = slice.dense.Between(slice.t_begin, slice.t_end);
    slice.dense.Evaluate(slice.t_begin, slice.x_begin.data());
    slice.dense.Evaluate(slice.t_end, slice.x_end.data());
    parts.push_back({slice.t_begin, slice.t_end, PropagateArc(&dynamics, slice, 1e-12)});
  }
  return parts;
}

/// Beside the propagators of runs that are wrong by ±e, entry by entry: a turned slip has another
/// friction. What parts hand on has its place and its sign.
TEST(PropagatorChange, IsWhatAnErrorOfTheStateChanges) {
  const auto puck = MakeSystem<example::Puck>({{"gyroscopic", 2}});
  const Vector x = test::Entries({0, 0, 0, 1, 0.5, 0});
  for (const Vector& direction :
       {test::Entries({0, 0, 0, 1, 0, 0}), test::Entries({0, 0, 0, -0.3, 1, 0})}) {
    const double size = 1e-4;
    const Matrix exact = (PartsOf(*puck, x + size * direction, 1).front().phi -
                          PartsOf(*puck, x - size * direction, 1).front().phi) /
                         (2 * size);
    for (const int count : {1, 2, 5}) {
      const std::vector<ArcPart> parts = PartsOf(*puck, x, count);
      std::vector<Vector> e;
      Vector carried = 1e-7 * direction;
      for (const ArcPart& part : parts) {
        carried = part.phi * carried;
        e.push_back(carried);
      }
      ContactDynamics dynamics(*puck, Vector(0));
      const Trajectory run = SlideOf(*puck, x);
      const Matrix change = PropagatorChange(&dynamics, run.arcs.front(), parts, e) / 1e-7;
      const double off = (change - exact).cwiseAbs().maxCoeff();
      // An estimate of first order in their length: e is that at the ends of the parts, which is
      // smaller than before.
      EXPECT_LT(off, 1.2 / count * exact.cwiseAbs().maxCoeff()) << count;
    }
  }
}

}  // namespace
}  // namespace contact_flow
