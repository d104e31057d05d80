// SPDX-License-Identifier: BSD-3-Clause
// What commands do to a state: contacts that have drifted are put back, impulses act
// through contacts.
#include <gtest/gtest.h>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

/// Four feet on the floor, moved off by 1e-7 in all coordinates and velocities.
TEST(ProjectContacts, MakesAnInitialStateOfOneThatHasDrifted) {
  for (const char* robot : {"quadruped", "planar_biped"}) {
    const auto system = LoadRobot(RobotFile(robot));
    const NominalRun& nominal = system->nominal();
    SimulateOptions options;
    options.complete_zeno = true;
    const Trajectory landing = Simulate(*system, nominal.x, nominal.u, 1.0, options);
    ASSERT_TRUE(landing.status.ok()) << landing.status.message;
    const ContactMode mode = landing.arcs.back().mode;
    ASSERT_GE(mode.Size(), 1) << robot;
    const Vector drift = Vector::Constant(2 * system->dof(), 1e-7);
    const Vector drifted = system->Perturb(landing.FinalState(), drift);
    EXPECT_THROW(
        InitialMode(*system, system->Perturb(landing.FinalState(), -100 * drift), nominal.u),
        std::invalid_argument);
    Vector x = drifted;
    ASSERT_TRUE(ProjectContacts(*system, mode, &x));
    EXPECT_EQ(InitialMode(*system, x, nominal.u), mode) << robot;
    ConstraintTerms terms;
    system->Constraints(x.head(system->num_positions()), x.tail(system->dof()), &terms);
    const Vector rate = terms.jacobian * x.tail(system->dof());
    for (int i : mode) {
      EXPECT_NEAR(terms.gap(i), 0, 1e-12);
      EXPECT_NEAR(rate(i), 0, 1e-12);
    }
    // The shortest way, in a metric whose inertias range over 1e-4 … 10.
    EXPECT_LT(system->Separation(x, drifted).cwiseAbs().maxCoeff(), 1e-5);
  }
}

TEST(ProjectContacts, LeavesAloneWhatIsExact) {
  const auto system = MakeModel("soft_biped");
  Vector x = system->nominal().x;
  EXPECT_TRUE(ProjectContacts(*system, ContactMode(), &x));
  EXPECT_EQ(x, system->nominal().x);
}

/// A ball of mass m: in flight the impulse is the change of momentum; on the floor half
/// of it comes back.
TEST(PushedVelocity, IsTheChangeOfMomentumAndWhatContactsGiveBack) {
  const auto system = MakeModel("bouncing_ball", {{"mass", 2.0}, {"restitution", 0.5}});
  ASSERT_EQ(system->dof(), 2);
  Vector x(4), impulse(2);
  x << 0, 1, 0.3, -0.2;
  impulse << 0.5, -1;
  EXPECT_TRUE(
      PushedVelocity(*system, x, impulse, 1e-9).isApprox(Eigen::Vector2d(0.55, -0.7), 1e-14));
  x << 0, 0, 0.3, 0;
  EXPECT_TRUE(
      PushedVelocity(*system, x, impulse, 1e-9).isApprox(Eigen::Vector2d(0.55, 0.25), 1e-14));
  impulse << 0, 1;
  EXPECT_TRUE(PushedVelocity(*system, x, impulse, 1e-9).isApprox(Eigen::Vector2d(0.3, 0.5), 1e-14))
      << "away from the floor";
}

}  // namespace
}  // namespace contact_flow
