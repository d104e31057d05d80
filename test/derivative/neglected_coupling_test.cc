// SPDX-License-Identifier: BSD-3-Clause
// Couplings that are neglected or not by what they change, and the derivative under
// the projection law.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::kImpactLaws;

/// Masses 1 and m; floor: a_0 = q_0 ≥ 0, slope: a_1 = q_1 + c q_0 ≥ 0. Normalized coupling c √m.
struct HeavyAndLight : test::UnitMasses<2, 2> {
  static constexpr const char* kName = "heavy_and_light";
  static constexpr std::array<const char*, 2> kCoordinates = {"heavy", "light"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "slope"};
  template <class P>
  struct Parameters {
    P mass = 1, coupling = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(mass, "mass", "kg", "", Range::kAny);
      visit(coupling, "coupling", "", "", Range::kAny);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                         Eigen::Matrix<S, 2, 2>* M) {
    UnitMasses::MassMatrix(p, q, M);
    (*M)(1, 1) = S(p.mass);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(-1.0);
    (*f)(1) = S(p.mass * (p.coupling - 1.0));
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(0);
    (*a)(1) = q(1) + p.coupling * q(0);
  }
};

/// Hit first, the slope is lifted with c times the speed of q_0 when the floor is hit; the floor by
/// c m times that of q_1. This is discontinuous where it is more than the error of the outcome, 1e3
/// tolerances, and reported as neglected where it is less, whatever the normalized coupling. The
/// projection law lifts nothing.
TEST(Coupling, IsJudgedByTheJumpOfTheOutcome) {
  for (double mass : {1e-8, 1e-4, 1.0, 1e4, 1e8}) {
    for (double coupling : {1e-14, 1e-10, 9e-7, 9e-3}) {
      if (coupling * std::max(1.0, mass) > 0.1) continue;  // not what the closed form is for
      for (ImpactLaw law : kImpactLaws) {
        SCOPED_TRACE(testing::Message() << "mass " << mass << ", coupling " << coupling);
        const auto system = test::Make<HeavyAndLight>({{"mass", mass}, {"coupling", coupling}});
        Vector x = Vector::Zero(4);
        x << 0.1, 0.1 - 0.1 * coupling, -1, -1 + coupling;
        SimulateOptions options;
        options.relative_tolerance = options.absolute_tolerance = 1e-12;
        options.impact_law = law;
        const Trajectory run = Simulate(system, x, Vector(0), 0.15, options);
        ASSERT_TRUE(run.status.ok());
        ASSERT_EQ(2, run.transitions.front().activated.Size());
        const BDerivative B = DifferentiateOutcome(system, run);
        const double speed = std::sqrt(1.2);  // √(1 + 2·0.1) of both
        const double jump = coupling * std::max(1.0, mass) * speed;
        if (jump > 1e-8 && law == ImpactLaw::kComplementarity) {
          EXPECT_EQ(Outcome::kDiscontinuous, B.status.outcome) << B.status.message;
          if (B.status.ok()) continue;
          double apart = 0;
          for (const OrderOutcome& outcome : B.events.back().outcomes()) {
            const Vector difference = outcome.v_plus - run.transitions[0].x_plus.tail(2);
            apart = std::max(apart, difference.cwiseAbs().maxCoeff());
          }
          EXPECT_NEAR(jump, apart, 2e-2 * jump);  // O(c) and O(c² m)
        } else {
          EXPECT_TRUE(B.status.ok()) << B.status.message;
          if (!B.status.ok()) continue;
          if (law == ImpactLaw::kComplementarity && coupling * std::sqrt(mass) > 1e-13) {
            EXPECT_GE(B.neglected_jump.maxCoeff(), jump);
          }
          EXPECT_LE(B.neglected_jump.maxCoeff(), 10 * std::min(jump, 1e-8));
        }
      }
    }
  }
}

/// The floor holds q_0 under f_0 = 1 + 2 v_1 until q_1, falling under f_1 = −1, is stopped by the
/// slope, which feels the floor by the coupling alone.
struct HeldByAFall : HeavyAndLight {
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(1.0) + 2.0 * v(1);
    (*f)(1) = S(-1.0);
  }
};

/// From (0, h, 0, −1) the slope is hit with s² = 1 + 2h at t₁ = s − 1, and the floor lets go. With
/// τ = T − t₁ and by c at c = 0:  δq_0 = τ²/2 − τ³/3 and δq_1 = −τ²/2, as q_1 = −c q_0. Where the
/// impact lifted the floor's contact, with c s, δq_0 would have s τ besides: not by projection,
/// which holds it however small its impulse.
TEST(Projection, HoldsAContactThatTheImpactDoesNotFeel) {
  const auto system = test::Make<HeldByAFall>({});
  Vector x(4);
  x << 0, 0.1, 0, -1;
  const double duration = 0.6, tau = duration - (std::sqrt(1.2) - 1);
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  options.impact_law = ImpactLaw::kProjection;
  const Trajectory run = Simulate(system, x, Vector(0), duration, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ(2u, run.transitions[0].mode_after.Members().bits());
  BDerivativeOptions derivative;
  derivative.variables.parameters = {1};  // the coupling
  const BDerivative B = DifferentiateOutcome(system, run, derivative);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (double sign : {1.0, -1.0}) {
    const Vector change = B(sign * Vector::Unit(5, 4));
    Vector truth(4);
    truth << tau * tau / 2 - tau * tau * tau / 3, -tau * tau / 2, tau - tau * tau, -tau;
    EXPECT_LT((change - sign * truth).cwiseAbs().maxCoeff(), 1e-9) << change.transpose();
  }
}

/// The run of a shipped biped on its rigid feet, with the bilateral law: the foot that landed first
/// is held where the other lands.
TEST(Projection, DerivativeOfThePlanarBiped) {
  const auto system = LoadRobot(RobotFile("planar_biped"));
  const NominalRun& nominal = system->nominal();
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  options.impact_law = ImpactLaw::kProjection;
  const double duration = 0.4;
  const Trajectory run = Simulate(*system, nominal.x, nominal.u, duration, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_FALSE(run.transitions.empty());
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  int compared = 0;
  for (int k = 0; k < 2 * system->dof(); ++k) {
    for (double sign : {1.0, -1.0}) {
      const Vector unit = sign * Vector::Unit(2 * system->dof(), k);
      const Vector w = ProjectAdmissible(*system, nominal.x, run.arcs.front().mode, unit);
      if ((w - unit).norm() > 1e-9) continue;
      const QuotientReport report = CompareWithQuotients(*system, nominal.x, nominal.u, duration, w,
                                                         B(w), {1e-4, 1e-5, 1e-6}, options);
      if (!report.samples.back().status.ok()) continue;
      ++compared;
      EXPECT_LE(report.samples.back().error,
                0.05 * report.samples.front().error + 1e-4 * (1 + B(w).cwiseAbs().maxCoeff()))
          << "direction " << k << ": " << report.samples.front().error;
    }
  }
  EXPECT_GT(compared, 4);
}

}  // namespace
}  // namespace contact_flow
