// SPDX-License-Identifier: BSD-3-Clause
// First-order times of events with friction, of return maps at an instant, beside
// one-sided quotients.
#include <gtest/gtest.h>

#include <random>

#include "contact_flow/analysis/poincare.h"
#include "test/friction/friction_case.h"

namespace contact_flow {
namespace {

void ExpectTimes(const std::string& name, const std::vector<WantedEvent>& events) {
  const test::FrictionCase c(name);
  const MechanicalSystem& system = *c.system;
  PoincareOptions options;
  options.events = events;
  const Section end = Section::After(c.duration);
  const PoincareReturn base = PoincareMap(system, c.u, end, options).Return(c.x);
  ASSERT_EQ(ReturnStatus::kReturned, base.status) << name << ": " << base.message;
  const auto count = static_cast<Eigen::Index>(events.size());
  std::mt19937 generator(8);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 6; ++trial) {
    Vector z(base.start_basis.cols());
    for (double& entry : z) entry = normal(generator);
    for (const double sign : {1.0, -1.0}) {
      const Vector w = sign * base.start_basis * z.normalized();
      const Vector rows = base.extended(w);
      EXPECT_LE((rows.head(2 * system.dof()) - base.map(w)).norm(), 1e-9 * (1 + rows.norm()));
      for (const double alpha : {1e-4, 1e-5}) {
        options.simulate.simultaneity_tolerance = 1e-4 * alpha;
        const PoincareReturn moved =
            PoincareMap(system, c.u, end, options).Return(system.Perturb(c.x, alpha * w), false);
        ASSERT_TRUE(moved.returned()) << moved.message;
        const Vector quotient = (moved.event_times - base.event_times) / alpha;
        // Second order: α times curvatures below 1000; runs to 1e-12.
        EXPECT_LE((quotient - rows.tail(count)).cwiseAbs().maxCoeff(), 1000 * alpha + 1e-10 / alpha)
            << name << " " << trial << " " << sign << " " << alpha;
      }
    }
  }
}

TEST(FrictionEventTimes, OfTouchdowns) {
  ExpectTimes("border_bounce", {{0, false, 1}});
  ExpectTimes("border_plastic_slip", {{0, false, 1}});
  ExpectTimes("land_while_stopping", {{1, false, 1}});
  ExpectTimes("soft_biped_friction", {{0, false, 1}, {1, false, 1}});
}

TEST(FrictionEventTimes, OfReleases) { ExpectTimes("noslip_liftoff", {{0, true, 1}}); }

}  // namespace
}  // namespace contact_flow
