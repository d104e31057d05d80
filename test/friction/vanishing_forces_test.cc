// SPDX-License-Identifier: BSD-3-Clause
// Contacts without force: where several words fit and lead to one motion it is told, and where the
// only word that fits does not go on to hold it is refused.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/friction/systems/contact_parameters.h"
#include "test/friction/systems/tip.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Entries;

void ExpectEnd(const MechanicalSystem& system, const Vector& x, double duration,
               const Vector& exact) {
  const Trajectory run = Simulate(system, x, Vector::Zero(0), duration);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_LE((run.FinalState() - exact).cwiseAbs().maxCoeff(), 1e-8)  // runs to 1e-9
      << run.FinalState().transpose();
}

/// Unit mass in the plane over a plastic floor.
std::unique_ptr<MechanicalSystem> Point(double mu, double along, double up) {
  return MakeSystem<test::Tip<2>>({{"mu0", mu}, {"f0", along}, {"f1", up}});
}

TEST(VanishingForces, WithoutGravity) {
  for (const double mu : {0.5, -1.0}) {
    ExpectEnd(*Point(mu, 0, 0), Entries({0, 0, 0, 0}), 1, Entries({0, 0, 0, 0}));
    // Lands at t = 0.5: friction takes 0.5 of the speed 1, or all of it.
    ExpectEnd(*Point(mu, 0, 0), Entries({0, 0.5, 1, -1}), 1,
              mu > 0 ? Entries({0.75, 0, 0.5, 0}) : Entries({0.5, 0, 0, 0}));
  }
}

/// It hits a wall at t = 0.2 with 2 m/s across and 2 m/s along it, and falls on beside it.
TEST(VanishingForces, BesideAWall) {
  ExpectEnd(*Point(0.5, -10, 0), Entries({0, 0.4, 0, -2}), 0.5,
            Entries({-0.2 - 0.3 - 0.45, 0, -4, 0}));
}

/// The force along is just what friction holds.
TEST(VanishingForces, OnTheBorderOfTheCone) {
  ExpectEnd(*Point(0.5, 5, -10), Entries({0, 0, 0, 0}), 1, Entries({0, 0, 0, 0}));
}

/// A block that slides on a floor into a wall.
struct Corner {
  static constexpr const char* kName = "corner";
  static constexpr const char* kSummary = "a floor and a wall";
  static constexpr int kDof = 2, kConstraints = 2, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "z"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "wall"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  using Parameters = test::ContactParameters<P>;
  template <class S>
  using V = Eigen::Matrix<S, 2, 1>;

  template <class P, class S>
  static void MassMatrix(const Parameters<P>&, const V<S>&, Eigen::Matrix<S, 2, 2>* M) {
    (*M)(0, 0) = (*M)(1, 1) = S(1.0);
    (*M)(0, 1) = (*M)(1, 0) = S(0.0);
  }
  template <class P, class S>
  static void Force(const Parameters<P>&, const V<S>&, const V<S>&, const Eigen::Matrix<S, 0, 1>&,
                    V<S>* f) {
    (*f)(0) = S(0.0);
    (*f)(1) = S(-9.81);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const V<S>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(1);
    (*a)(1) = 0.5 - q(0);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const V<S>&, const V<S>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0);
    (*s)(1) = v(1);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) {
    return p.Mu(i);
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return p.Gamma(i);
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(4);
    run.u = Vector::Zero(0);
    return run;
  }
};

TEST(VanishingForces, OfAWallThatStopsABlock) {
  for (const double wall : {0.0, 0.5}) {
    ExpectEnd(*MakeSystem<Corner>({{"mu0", 0.5}, {"mu1", wall}}), Entries({0, 0, 5, 0}), 1,
              Entries({0.5, 0, 0, 0}));
  }
}

/// A tip that does not slip, at rest under f = (f_x, t − 1): its normal force, −f_z, vanishes at
/// t = 1. Let go, its gap accelerates by (M⁻¹ f)_z = −0.9 f_x/det M.
struct Pulled {
  static constexpr const char* kName = "pulled";
  static constexpr const char* kSummary = "a tip with coupled inertia and a clock";
  static constexpr int kDof = 3, kConstraints = 1, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "z", "clock"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"toe"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters {
    P along = 3;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(along, "along", "N", "f_x", Range::kAny);
    }
  };
  template <class S>
  using V = Eigen::Matrix<S, 3, 1>;

  template <class P, class S>
  static void MassMatrix(const Parameters<P>&, const V<S>&, Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(i == j ? 1.0 : 0.0);
    }
    (*M)(0, 0) = S(2.0);
    (*M)(0, 1) = (*M)(1, 0) = S(0.9);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const V<S>& q, const V<S>&,
                    const Eigen::Matrix<S, 0, 1>&, V<S>* f) {
    (*f)(0) = S(p.along);
    (*f)(1) = q(2) - 1.0;
    (*f)(2) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const V<S>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(1);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const V<S>&, const V<S>& v, Eigen::Matrix<S, 1, 1>* s) {
    (*s)(0) = v(0);
  }
  template <class P>
  static P Friction(const Parameters<P>&, int) {
    return P(contact_flow::Friction::kNoSlip);
  }
  template <class P>
  static P Restitution(const Parameters<P>&, int) {
    return P(0.0);
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.x(5) = 1;
    run.u = Vector::Zero(0);
    return run;
  }
};

TEST(VanishingForces, NoWordFollows) {
  const auto presses = MakeSystem<Pulled>({{"along", 3}});
  const Trajectory jam = Simulate(*presses, presses->nominal().x, Vector::Zero(0), 2);
  EXPECT_EQ(Outcome::kPainleveInconsistent, jam.status.outcome) << jam.status.message;
  EXPECT_NE(std::string::npos, jam.status.message.find("toe")) << jam.status.message;
  EXPECT_NEAR(1, jam.t_end(), 1e-8);
  const auto lifts = MakeSystem<Pulled>({{"along", -1}});
  const Trajectory run = Simulate(*lifts, lifts->nominal().x, Vector::Zero(0), 2);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_TRUE(run.arcs.back().mode.Empty());
  EXPECT_NEAR(1, run.transitions.front().t, 1e-8);
}

}  // namespace
}  // namespace contact_flow
