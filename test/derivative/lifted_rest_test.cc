// SPDX-License-Identifier: BSD-3-Clause
// A contact that the impact of another lifts too slowly to be resolved, and an input that changes
// at that instant: by the equations it is in flight in between, in the run it rests.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Entries;

/// Two bodies on floors of their own, coupled by their masses; the input lifts the second one. A
/// third one flies, fast, and touches nothing.
struct CoupledBodies : test::UnitMasses<3, 2> {
  static constexpr const char* kName = "coupled_bodies";
  static constexpr int kInputs = 1;
  static constexpr std::array<const char*, 3> kCoordinates = {"a", "b", "c"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"first", "second"};
  static constexpr std::array<const char*, 1> kInputNames = {"lift"};
  template <class P>
  struct Parameters {
    P coupling = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(coupling, "coupling", "", "of the masses", Range::kAny);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    M->setIdentity();
    (*M)(0, 1) = (*M)(1, 0) = S(-p.coupling);
  }
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 1, 1>& u,
                    Eigen::Matrix<S, 3, 1>* f) {
    f->setZero();
    (*f)(1) = u(0) - 100.0;
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    *a = q.template head<2>();
  }
};

/// The first lands with 0.1 m/s, which lifts the second by 0.1 m/s times the coupling.
TEST(LiftedRest, IsRefusedWhereTheInputChanges) {
  const Vector rest = Entries({0}), lift = Entries({130});
  const InputSchedule schedule{{0, 0.1}, {rest, lift}};
  for (const double coupling : {0., 5e-6, 5e-8}) {
    const ModelSystem<CoupledBodies> system({{"coupling", coupling}});
    const Vector x = Entries({0.01, 0, 0, -0.1, 0, 10});
    const Trajectory run = Simulate(system, x, schedule, 0.3, AtTolerance(1e-12));
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    const BDerivative B = DifferentiateOutcome(system, run);
    if (coupling == 0) {
      ASSERT_TRUE(B.status.ok()) << B.status.message;
      EXPECT_NEAR(0, B(-Vector::Unit(6, 0))(4), 1e-9) << "the second lies until the input changes";
      continue;
    }
    EXPECT_EQ(Outcome::kNotDifferentiable, B.status.outcome) << coupling;
    EXPECT_NE(std::string::npos, B.status.message.find("'second' is lifted so slowly"))
        << B.status.message;
  }
}

}  // namespace
}  // namespace contact_flow
