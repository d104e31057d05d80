// SPDX-License-Identifier: BSD-3-Clause
// Simulate against the event-driven scheme of Siconos (LSODAR between impacts, Newton's impact law)
// on elastic systems with linear forces.
#include <gtest/gtest.h>

#include "contact_flow/flow/simulate.h"

#if CONTACT_FLOW_HAVE_SICONOS

#include <SiconosKernel.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <random>

#include "contact_flow/model/model_library.h"
#include "contact_flow/model/model_system.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::Tight;

/// M q̈ = load − K q − D q̇ in the quadrant q ≥ 0, each wall with a restitution of its own.
struct LinearPair : test::UnitMasses<2, 2> {
  static constexpr const char* kName = "linear_pair";
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "y"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"wall", "floor"};
  template <class P>
  struct Parameters {
    P m00 = 1, m01 = 0, m11 = 1, k00 = 0, k01 = 0, k11 = 0, d00 = 0, d01 = 0, d11 = 0;
    P load0 = 0, load1 = 0, restitution0 = 1, restitution1 = 1;
    template <class V>
    void Visit(V&& visit) {
      visit(m00, "m00", "kg", "mass", Range::kPositive);
      visit(m01, "m01", "kg", "mass", Range::kAny);
      visit(m11, "m11", "kg", "mass", Range::kPositive);
      visit(k00, "k00", "N/m", "stiffness", Range::kAny);
      visit(k01, "k01", "N/m", "stiffness", Range::kAny);
      visit(k11, "k11", "N/m", "stiffness", Range::kAny);
      visit(d00, "d00", "N s/m", "damping", Range::kAny);
      visit(d01, "d01", "N s/m", "damping", Range::kAny);
      visit(d11, "d11", "N s/m", "damping", Range::kAny);
      visit(load0, "load0", "N", "load", Range::kAny);
      visit(load1, "load1", "N", "load", Range::kAny);
      visit(restitution0, "restitution0", "", "of the wall", Range::kUnitInterval);
      visit(restitution1, "restitution1", "", "of the floor", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>&,
                         Eigen::Matrix<S, 2, 2>* M) {
    (*M)(0, 0) = S(p.m00);
    (*M)(0, 1) = (*M)(1, 0) = S(p.m01);
    (*M)(1, 1) = S(p.m11);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = p.load0 - p.k00 * q(0) - p.k01 * q(1) - p.d00 * v(0) - p.d01 * v(1);
    (*f)(1) = p.load1 - p.k01 * q(0) - p.k11 * q(1) - p.d01 * v(0) - p.d11 * v(1);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    *a = q;
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return i == 0 ? p.restitution0 : p.restitution1;
  }
};

struct SiconosRun {
  Vector x;         ///< final state
  int impacts = 0;  ///< events that are no points of the time grid
};

/// The run by Siconos, with the constraints normals·q ≥ 0, one a row.
SiconosRun RunSiconos(const Matrix& M, const Matrix& K, const Matrix& D, const Vector& load,
                      const Matrix& normals, const Vector& restitution, const Vector& x,
                      double duration) {
  const auto matrix = [](const Matrix& values) {
    auto result = std::make_shared<SimpleMatrix>(values.rows(), values.cols());
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      for (Eigen::Index j = 0; j < values.cols(); ++j) result->setValue(i, j, values(i, j));
    }
    return result;
  };
  const auto vector = [](const Vector& values) {
    auto result = std::make_shared<SiconosVector>(values.size());
    for (Eigen::Index i = 0; i < values.size(); ++i) result->setValue(i, values(i));
    return result;
  };
  const Eigen::Index d = load.size();
  const auto body = std::make_shared<LagrangianLinearTIDS>(vector(x.head(d)), vector(x.tail(d)),
                                                           matrix(M), matrix(K), matrix(D));
  body->setFExtPtr(vector(load));
  const auto system = std::make_shared<NonSmoothDynamicalSystem>(0., duration);
  system->insertDynamicalSystem(body);
  for (Eigen::Index i = 0; i < normals.rows(); ++i) {
    system->link(std::make_shared<Interaction>(
                     std::make_shared<NewtonImpactNSL>(restitution(i)),
                     std::make_shared<LagrangianLinearTIR>(matrix(normals.row(i)))),
                 body);
  }
  const auto run = std::make_shared<EventDriven>(
      system, std::make_shared<TimeDiscretisation>(0., duration / 10));
  run->insertIntegrator(std::make_shared<LsodarOSI>());
  const auto lcp = [] { return std::make_shared<LCP>(SICONOS_LCP_LEMKE); };
  run->insertNonSmoothProblem(lcp(), SICONOS_OSNSP_ED_IMPACT);
  run->insertNonSmoothProblem(lcp(), SICONOS_OSNSP_ED_SMOOTH_ACC);
  run->initialize();
  SiconosRun result;
  while (run->hasNextEvent()) {
    run->advanceToEvent();
    if (run->eventsManager()->nextEvent()->getType() == NS_EVENT) ++result.impacts;
    run->processEvents();
  }
  result.x.resize(2 * d);
  for (Eigen::Index i = 0; i < d; ++i) {
    result.x(i) = body->q()->getValue(i);
    result.x(d + i) = body->velocity()->getValue(i);
  }
  return result;
}

// Both integrate at 1e-12 or better a step, over at most ~100 steps; an impact that is mistimed by
// δ shifts the state after it by (1+γ)|v|·δ, again ~1e-12. What is asked for is 1e-9.
constexpr double kAgreement = 1e-9;

TEST(SiconosEventDriven, ABallThatMeetsFloorAndWallAtOnce) {
  const double gravity = 9.81, restitution = 0.7;
  const auto ball =
      MakeModel("ball_in_corner", {{"gravity", gravity}, {"restitution", restitution}});
  const NominalRun& nominal = ball->nominal();
  const Trajectory ours = Simulate(*ball, nominal.x, nominal.u, nominal.duration, Tight());
  ASSERT_TRUE(ours.status.ok()) << ours.status.message;
  ASSERT_EQ(2, ours.transitions.front().activated.Size());
  const SiconosRun theirs =
      RunSiconos(Matrix::Identity(2, 2), Matrix::Zero(2, 2), Matrix::Zero(2, 2),
                 Eigen::Vector2d(0, -gravity), Matrix::Identity(2, 2).rowwise().reverse(),
                 Vector::Constant(2, restitution), nominal.x, nominal.duration);
  EXPECT_GE(theirs.impacts, 1);
  EXPECT_LE((ours.FinalState() - theirs.x).cwiseAbs().maxCoeff(), kAgreement);
}

TEST(SiconosEventDriven, RandomElasticSystemsWithLinearForces) {
  constexpr unsigned kSeed = 4;
  constexpr int kSystems = 40;
  constexpr double kDuration = 1.5;
  std::mt19937 generator(kSeed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int impacts = 0, compared = 0;
  double worst = 0;
  for (int trial = 0; trial < kSystems; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(kSeed) + ", trial " + std::to_string(trial));
    ParameterValues p;
    const auto draw = [&](const char* name, double middle, double half) {
      return p[name] = middle + half * uniform(generator);
    };
    Matrix M(2, 2), K(2, 2), D(2, 2);
    M << draw("m00", 1.5, 0.5), draw("m01", 0, 0.5), 0, draw("m11", 1.5, 0.5);
    K << draw("k00", 6, 4), draw("k01", 0, 2), 0, draw("k11", 6, 4);
    D << draw("d00", 0.3, 0.2), draw("d01", 0, 0.1), 0, draw("d11", 0.3, 0.2);
    for (Matrix* A : {&M, &K, &D}) (*A)(1, 0) = (*A)(0, 1);
    // A wall that the springs pull into: several impacts in each run, and
    // accumulation far beyond it.
    const Eigen::Vector2d load(draw("load0", -2, 1), draw("load1", -2, 1));
    const Eigen::Vector2d restitution(draw("restitution0", 0.85, 0.1),
                                      draw("restitution1", 0.85, 0.1));
    Vector x(4);
    x << 1 + 0.5 * uniform(generator), 1 + 0.5 * uniform(generator), uniform(generator),
        uniform(generator);
    const auto system = test::Make<LinearPair>(p);
    const Trajectory ours = Simulate(system, x, Vector(0), kDuration, Tight());
    ASSERT_TRUE(ours.status.ok()) << ours.status.message;
    const SiconosRun theirs =
        RunSiconos(M, K, D, load, Matrix::Identity(2, 2), restitution, x, kDuration);
    EXPECT_EQ(static_cast<int>(ours.transitions.size()), theirs.impacts);
    const double difference = (ours.FinalState() - theirs.x).cwiseAbs().maxCoeff();
    EXPECT_LE(difference, kAgreement);
    worst = std::max(worst, difference);
    impacts += theirs.impacts;
    ++compared;
  }
  EXPECT_EQ(kSystems, compared);
  EXPECT_GE(impacts, 2 * kSystems) << "the runs bounce";
  std::cout << "seed " << kSeed << ": " << impacts << " impacts, largest difference " << worst
            << '\n';
}

}  // namespace
}  // namespace contact_flow

#else

TEST(SiconosEventDriven, ABallThatMeetsFloorAndWallAtOnce) {
  GTEST_SKIP() << "built without Siconos (libsiconos-kernel-dev)";
}

TEST(SiconosEventDriven, RandomElasticSystemsWithLinearForces) {
  GTEST_SKIP() << "built without Siconos (libsiconos-kernel-dev)";
}

#endif
