// SPDX-License-Identifier: BSD-3-Clause
// Return maps: a ball whose map is known, one-sided quotients of simulated returns, the
// trot's stability.
#include "contact_flow/analysis/poincare.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/section.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "test/reference_case.h"

namespace contact_flow {
namespace {

using test::ReferenceCase;

TEST(Poincare, ApexOfABallIsKnown) {
  constexpr double kRestitution = 0.6, kGravity = 9.81, kHeight = 1.3;
  const auto ball = MakeModel("bouncing_ball", {{"restitution", kRestitution}});
  const PoincareMap map(*ball, Vector(0), Section::Apex(*ball, "z"));
  Vector x(4);
  x << 0.2, kHeight, 0.7, 0;
  const PoincareReturn apex = map.Return(x);
  ASSERT_EQ(ReturnStatus::kReturned, apex.status) << apex.message;
  const double time = (1 + kRestitution) * std::sqrt(2 * 2 * kHeight / kGravity) -
                      (1 + kRestitution) * std::sqrt(2 * kHeight / kGravity) * (std::sqrt(2.0) - 1);
  EXPECT_NEAR(time, apex.time, 1e-12);
  Vector expected(4);
  expected << 0.2 + 0.7 * time, kRestitution * kRestitution * kHeight, 0.7, 0;
  EXPECT_LE((apex.x - expected).norm(), 1e-11);
  EXPECT_NEAR(-kGravity, apex.crossing_speed, 1e-12);
  // Dz′/dz = γ², x′ = x + vₓ T with dT/dz = T/(2z).
  EXPECT_NEAR(time / (2 * kHeight), apex.return_time(Vector::Unit(4, 1))(0), 1e-9);
  ASSERT_EQ(3, apex.reduced.rows());
  ASSERT_EQ(1u, apex.reduced.pieces().size());
  const Vector moduli = apex.reduced.pieces()[0].matrix.eigenvalues().cwiseAbs();
  EXPECT_NEAR(kRestitution * kRestitution, moduli.minCoeff(), 1e-9) << "no spurious zero";
  Vector column(4);
  column << 0.7 * time / (2 * kHeight), kRestitution * kRestitution, 0, 0;
  EXPECT_LE((apex.map(Vector::Unit(4, 1)) - column).norm(), 1e-9);

  // Horizontal position and velocity are neutral.
  Matrix horizontal = Matrix::Zero(4, 2);
  horizontal(0, 0) = horizontal(2, 1) = 1;
  const ReducedMap reduced = SetAside(apex.reduced, apex.start_basis.transpose() * horizontal);
  EXPECT_LE(reduced.residual, 1e-9);
  ASSERT_EQ(1, reduced.map.rows());
  StabilityOptions few;
  few.max_words = 100;
  EXPECT_EQ(StabilityVerdict::kUndetermined, AssessStability(apex.reduced, few).verdict);
  EXPECT_EQ(StabilityVerdict::kStable, AssessStability(reduced.map).verdict);
}

TEST(Poincare, ImpactOfABallIsKnown) {
  const auto ball = MakeModel("bouncing_ball", {{"restitution", 0.6}});
  const PoincareMap map(*ball, Vector(0), Section::Event(*ball, "floor"));
  Vector x(4);
  x << 0, 0, 0.5, 3;
  const PoincareReturn impact = map.Return(x);
  ASSERT_EQ(ReturnStatus::kReturned, impact.status) << impact.message;
  EXPECT_NEAR(2 * 3 / 9.81, impact.time, 1e-12);
  EXPECT_NEAR(0.6 * 3, impact.x(3), 1e-11);
  EXPECT_NEAR(-3, impact.crossing_speed, 1e-11);
  ASSERT_EQ(3, impact.reduced.rows());
  EXPECT_NEAR(0.6, impact.map(Vector::Unit(4, 3))(3), 1e-9);
  EXPECT_NEAR(2 / 9.81, impact.return_time(Vector::Unit(4, 3))(0), 1e-9);
  EXPECT_LE(std::abs(impact.map(Vector::Unit(4, 3))(1)), 1e-9) << "the height stays zero";
}

/// Slope of log|(P(x+αw) − P(x))/α − DP w| over log α; NaN when the errors are at the
/// level of rounding.
double QuotientSlope(const MechanicalSystem& system, const Vector& u, const Section& section,
                     const Vector& x, const Vector& w) {
  PoincareOptions options;
  options.horizon = 6;
  const PoincareReturn base = PoincareMap(system, u, section, options).Return(x);
  EXPECT_EQ(ReturnStatus::kReturned, base.status) << base.message;
  const Vector predicted = base.map(w);
  const double predicted_time = base.return_time(w)(0);
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, last = 0;
  for (double alpha : {1e-3, 3e-4, 1e-4, 3e-5, 1e-5}) {
    options.simulate.simultaneity_tolerance = 1e-4 * alpha;
    const PoincareReturn moved =
        PoincareMap(system, u, section, options).Return(system.Perturb(x, alpha * w), false);
    EXPECT_TRUE(moved.returned()) << moved.message;
    if (!moved.returned()) return 0;
    const Vector quotient = system.Separation(moved.x, base.x) / alpha;
    last = std::max((quotient - predicted).cwiseAbs().maxCoeff(),
                    std::abs((moved.time - base.time) / alpha - predicted_time));
    if (last < 1e-9 / alpha) continue;  // integration to 1e-12, amplified along the run
    const double a = std::log(alpha), b = std::log(last);
    n += 1, sx += a, sy += b, sxx += a * a, sxy += a * b;
  }
  EXPECT_LE(last, 1e-2 * (1 + predicted.norm()));
  if (n < 2) return std::nan("");
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

void ExpectFirstOrder(const MechanicalSystem& system, const Vector& u, const Section& section,
                      const Vector& x, int directions) {
  PoincareOptions options;
  options.horizon = 6;
  const PoincareReturn base = PoincareMap(system, u, section, options).Return(x);
  ASSERT_EQ(ReturnStatus::kReturned, base.status) << base.message;
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  for (int k = 0; k < directions; ++k) {
    Vector z(base.start_basis.cols());
    for (Eigen::Index i = 0; i < z.size(); ++i) z(i) = normal(generator);
    const Vector w = base.start_basis * z.normalized();
    const double slope = QuotientSlope(system, u, section, x, w);
    EXPECT_TRUE(std::isnan(slope) || std::abs(slope - 1) <= 0.1)
        << slope << " along " << w.transpose();
    // What returns is a tangent of the section.
    const Vector image = base.map(w);
    EXPECT_LE((image - base.end_basis * (base.end_basis.transpose() * image)).norm(),
              1e-8 * (1 + image.norm()));
    EXPECT_LE((base.end_basis.transpose() * image - base.reduced(z.normalized())).norm(),
              1e-8 * (1 + image.norm()));
  }
}

TEST(PoincareQuotients, OfTheHoppingTrot) {
  for (const char* name : {"hopping_trot_stable", "hopping_trot_unstable"}) {
    const ReferenceCase trot(name);
    ExpectFirstOrder(*trot.system, trot.u, Section::Apex(*trot.system, "body_z"), trot.x, 6);
  }
  const ReferenceCase trot("hopping_trot_stable");
  ExpectFirstOrder(*trot.system, trot.u, Section::After(0.8), trot.x, 3);
}

TEST(PoincareQuotients, OfTheHoppingTrotAtATouchdown) {
  const ReferenceCase trot("hopping_trot_stable");
  const Section touchdown = Section::Event(*trot.system, "left_foot");
  Vector x = trot.x;
  x(4) += 0.01;  // the left foot lands later, alone
  PoincareOptions options;
  const PoincareMap map(*trot.system, trot.u, touchdown, options);
  const PoincareReturn first = map.Return(x);
  ASSERT_EQ(ReturnStatus::kReturned, first.status) << first.message;
  ASSERT_EQ(10, first.end_basis.cols()) << "both feet stand: four dimensions are lost";
  ExpectFirstOrder(*trot.system, trot.u, touchdown, first.x, 4);
}

TEST(PoincareQuotients, OfOtherModels) {
  const ReferenceCase biped("soft_biped_tilted");
  ExpectFirstOrder(*biped.system, biped.u, Section::Coordinate(*biped.system, "body_z", 0.7, -1),
                   biped.x, 4);
  const ReferenceCase together("soft_biped_simultaneous");
  ExpectFirstOrder(*together.system, together.u,
                   Section::Coordinate(*together.system, "body_z", 0.4, 1), together.x, 4);
  // At the height 0.5 m the feet touch down: there the return map has no derivative.
  EXPECT_EQ(ReturnStatus::kNoDerivative,
            PoincareMap(*together.system, together.u,
                        Section::Coordinate(*together.system, "body_z", 0.5, -1))
                .Return(together.x)
                .status);
  const ReferenceCase pendulum("double_pendulum_simultaneous");
  const Vector& x = pendulum.x;
  ExpectFirstOrder(*pendulum.system, pendulum.u,
                   Section::Coordinate(*pendulum.system, "shoulder", 0.1, 1), x, 4);
  const auto ball = MakeModel("bouncing_ball");
  ExpectFirstOrder(*ball, Vector(0), Section::Apex(*ball, "z"), ball->nominal().x, 3);
  ExpectFirstOrder(*ball, Vector(0), Section::Event(*ball, "floor"), ball->nominal().x, 3);
}

TEST(Poincare, StabilityOfTheTrotOnceHorizontalSymmetryIsSetAside) {
  for (const auto& [name, verdict] :
       {std::pair("hopping_trot_stable", StabilityVerdict::kStable),
        std::pair("hopping_trot_unstable", StabilityVerdict::kUnstable)}) {
    const ReferenceCase trot(name);
    const PoincareMap map(*trot.system, trot.u, Section::Apex(*trot.system, "body_z"));
    const PoincareReturn apex = map.Return(trot.x);
    ASSERT_EQ(ReturnStatus::kReturned, apex.status) << apex.message;
    EXPECT_NEAR(0.8, apex.time, 1e-10);
    EXPECT_LE((apex.x - trot.x).cwiseAbs().maxCoeff(), 1e-9);
    ASSERT_EQ(13, apex.reduced.rows());
    EXPECT_GE(apex.reduced.pieces().size(), 2u);
    Matrix horizontal = Matrix::Zero(14, 2);
    for (int i : {0, 1, 2}) horizontal(i, 0) = horizontal(7 + i, 1) = 1;
    const ReducedMap reduced = SetAside(apex.reduced, apex.start_basis.transpose() * horizontal);
    EXPECT_LE(reduced.residual, 1e-8);
    const StabilityReport report = AssessStability(reduced.map);
    std::printf("%s: %s (%zu pieces, residual %.1e)\n", name, report.message.c_str(),
                reduced.map.pieces().size(), reduced.residual);
    EXPECT_EQ(verdict, report.verdict) << report.message;
    EXPECT_TRUE(VerifyCertificate(reduced.map, report.certificate));
    StabilityOptions few;
    few.max_words = 100;
    EXPECT_NE(StabilityVerdict::kStable, AssessStability(apex.reduced, few).verdict)
        << "translation is neutral";
  }
}

/// Event times along w, one-sided quotients beside the derivative's rows.
void ExpectEventTimes(const MechanicalSystem& system, const Vector& u, const Section& section,
                      const Vector& x, const std::vector<WantedEvent>& events) {
  PoincareOptions options;
  options.events = events;
  const PoincareReturn base = PoincareMap(system, u, section, options).Return(x);
  ASSERT_EQ(ReturnStatus::kReturned, base.status) << base.message;
  const auto count = static_cast<Eigen::Index>(events.size());
  ASSERT_EQ(2 * system.dof() + 1 + count, base.extended.rows());
  std::mt19937 generator(8);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 8; ++trial) {
    Vector z(base.start_basis.cols());
    for (double& entry : z) entry = normal(generator);
    const Vector w = base.start_basis * z.normalized();
    const Vector rows = base.extended(w);
    EXPECT_LE((rows.head(2 * system.dof()) - base.map(w)).norm(), 1e-12 * (1 + rows.norm()));
    EXPECT_NEAR(rows(2 * system.dof()), base.return_time(w)(0), 1e-12);
    for (double alpha : {1e-3, 1e-4, 1e-5}) {
      options.simulate.simultaneity_tolerance = 1e-4 * alpha;
      const PoincareReturn moved =
          PoincareMap(system, u, section, options).Return(system.Perturb(x, alpha * w), false);
      ASSERT_TRUE(moved.returned()) << moved.message;
      const Vector quotient = (moved.event_times - base.event_times) / alpha;
      EXPECT_LE((quotient - rows.tail(count)).cwiseAbs().maxCoeff(), 100 * alpha + 1e-10 / alpha)
          << trial << " " << alpha;
    }
  }
}

TEST(PoincareEventTimes, AgreeWithQuotients) {
  // Both feet at once, and released at once: orthogonal contacts.
  const ReferenceCase trot("hopping_trot_stable");
  ExpectEventTimes(*trot.system, trot.u, Section::Apex(*trot.system, "body_z"), trot.x,
                   {{0, false, 1}, {1, false, 1}, {0, true, 1}, {1, true, 1}});
  // Contacts that attract each other: the second lands when the first one's impact lets it.
  const auto corner = MakeModel("corner", {{"angle", 2.0}, {"restitution", 0}});
  const NominalRun& nominal = corner->nominal();
  PoincareOptions probe;
  probe.events = {{0, false, 1}, {1, false, 1}};
  const PoincareReturn at_once =
      PoincareMap(*corner, nominal.u, Section::After(nominal.duration), probe).Return(nominal.x);
  ASSERT_EQ(ReturnStatus::kReturned, at_once.status) << at_once.message;
  EXPECT_EQ(at_once.event_times(0), at_once.event_times(1));
  ExpectEventTimes(*corner, nominal.u, Section::After(nominal.duration), nominal.x, probe.events);
}

TEST(PoincareEventTimes, SayWhatIsMissing) {
  const ReferenceCase trot("hopping_trot_stable");
  PoincareOptions options;
  options.events = {{0, false, 2}};
  const PoincareReturn once =
      PoincareMap(*trot.system, trot.u, Section::Apex(*trot.system, "body_z"), options)
          .Return(trot.x);
  EXPECT_TRUE(std::isnan(once.event_times(0)));
  EXPECT_EQ(ReturnStatus::kNoDerivative, once.status);
  EXPECT_NE(std::string::npos, once.message.find("touchdown number 2 of 'left_foot'"))
      << once.message;
  options.events = {{7, false, 1}};
  EXPECT_THROW(PoincareMap(*trot.system, trot.u, Section::After(1), options),
               std::invalid_argument);
}

TEST(Poincare, SaysWhyThereIsNoReturn) {
  const auto ball = MakeModel("bouncing_ball");
  Vector x = ball->nominal().x;
  PoincareOptions options;
  options.horizon = 0.2;
  const Section apex = Section::Apex(*ball, "z");
  EXPECT_EQ(ReturnStatus::kNoReturn, PoincareMap(*ball, Vector(0), apex, options).Return(x).status);
  options.horizon = 20;  // Zeno comes first
  const Section high = Section::Coordinate(*ball, "z", 5, 1);
  EXPECT_EQ(ReturnStatus::kStopped, PoincareMap(*ball, Vector(0), high, options).Return(x).status);
  Vector below = x;
  below(1) = -1;
  EXPECT_EQ(ReturnStatus::kRefused,
            PoincareMap(*ball, Vector(0), apex, options).Return(below).status);
  EXPECT_THROW(Section::Apex(*ball, "zz"), std::invalid_argument);
  EXPECT_THROW(PoincareMap(*ball, Vector(0), Section::After(-1)), std::invalid_argument);
  // Two feet at once: the landing of one is no section with a derivative.
  const ReferenceCase trot("hopping_trot_stable");
  const PoincareReturn clustered =
      PoincareMap(*trot.system, trot.u, Section::Event(*trot.system, "left_foot")).Return(trot.x);
  EXPECT_EQ(ReturnStatus::kNoDerivative, clustered.status);
  EXPECT_TRUE(clustered.returned());
}

}  // namespace
}  // namespace contact_flow
