// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/assumptions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// A point between two walls whose inward normals make the angle `angle`, and a third wall along
/// the first: G_01 = cos(angle); constraints 0 and 2 are dependent.
struct Walls : test::UnitMasses<2, 3> {
  static constexpr const char* kName = "walls";
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "y"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 3> kConstraintNames = {"floor", "wall", "second_floor"};
  template <class P>
  struct Parameters {
    P angle = 1, restitution = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(angle, "angle", "rad", "between the normals", Range::kAny);
      visit(restitution, "restitution", "", "of all", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(0.0);
    (*f)(1) = S(-1.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 3, 1>* a) {
    using std::cos;
    using std::sin;
    (*a)(0) = q(1);
    (*a)(1) = cos(p.angle) * q(1) + sin(p.angle) * q(0);
    (*a)(2) = 2.0 * q(1);
  }
  template <class P>
  static auto Restitution(const P& p, int) {
    return p.restitution;
  }
};

AssumptionReport AtCorner(double angle, double restitution, ConstraintSet touching = {0, 1}) {
  const auto walls = test::Make<Walls>({{"angle", angle}, {"restitution", restitution}});
  return AssessAssumptions(walls, Vector::Zero(4), Vector(0), touching);
}

TEST(Assumptions, ClassifyACornerByItsAngle) {
  EXPECT_EQ(ContactClass::kOrthogonal, AtCorner(M_PI / 2, 0).contact_class);
  EXPECT_EQ(ContactClass::kOrthogonal, AtCorner(M_PI / 2, 0.5).contact_class);
  EXPECT_EQ(ContactClass::kOrderDependent, AtCorner(M_PI / 3, 0).contact_class);
  EXPECT_EQ(ContactClass::kOrderDependent, AtCorner(M_PI / 3, 0.5).contact_class);
  EXPECT_EQ(ContactClass::kAttracting, AtCorner(2 * M_PI / 3, 0).contact_class);
  EXPECT_EQ(ContactClass::kOrderDependent, AtCorner(2 * M_PI / 3, 0.5).contact_class);
}

TEST(Assumptions, MeasureCouplingAndCondition) {
  const double angle = 0.7, c = std::cos(angle);
  const AssumptionReport report = AtCorner(angle, 0);
  EXPECT_TRUE(report.smooth);
  EXPECT_NEAR(1, report.mass_condition, 1e-12);
  ASSERT_EQ(1u, report.couplings.size());
  EXPECT_NEAR(c, report.couplings[0].value, 1e-14);
  EXPECT_NEAR((1 + c) / (1 - c), report.condition, 1e-10) << "eigenvalues 1 ± cos";
  EXPECT_EQ(2, report.rank);
  EXPECT_TRUE(report.qualified);
}

TEST(Assumptions, DependentConstraintsAreFoundAndMayStillBeQualified) {
  const AssumptionReport report = AtCorner(1, 0, {0, 2});
  EXPECT_EQ(ContactClass::kDependent, report.contact_class);
  EXPECT_EQ(1, report.rank);
  EXPECT_TRUE(std::isinf(report.condition));
  EXPECT_TRUE(report.qualified) << "moving up opens both";
}

TEST(Assumptions, SingleContactsNeedNothing) {
  EXPECT_EQ(ContactClass::kSingle, AtCorner(1, 0.5, {1}).contact_class);
  EXPECT_EQ(ContactClass::kSingle, AtCorner(1, 0.5, {}).contact_class);
}

TEST(Assumptions, AreReportedForEveryTransition) {
  const auto classes = [](const std::string& name, int count) {
    const auto system = MakeModel(name);
    const Trajectory run =
        Simulate(*system, system->nominal().x, system->nominal().u, system->nominal().duration);
    const std::vector<AssumptionReport> reports = AssessTransitions(*system, run);
    EXPECT_EQ(count, static_cast<int>(reports.size()));
    return reports.front().contact_class;
  };
  EXPECT_EQ(ContactClass::kOrthogonal, classes("soft_biped", 1));
  EXPECT_EQ(ContactClass::kOrderDependent, classes("rigid_biped", 1));
  EXPECT_EQ(ContactClass::kOrthogonal, classes("hopping_trot", 2));
  EXPECT_EQ(ContactClass::kOrthogonal, classes("double_pendulum", 1));
}

TEST(AssumptionsInARegion, FindHowTheCouplingOfTwoContactsVaries) {
  const auto rigid = MakeModel("rigid_biped");
  Vector half_width = Vector::Zero(6);
  half_width(1) = 0.2;
  half_width(2) = 0.3;
  const RegionReport report = AssessRegion(*rigid, rigid->nominal().x, Vector(0), half_width, 50);
  ASSERT_EQ(1u, report.pairs.size());
  EXPECT_EQ(50, report.smooth);
  EXPECT_EQ(50, report.pairs[0].met) << "both feet can stand from any of these";
  // Both feet stand only without pitch: the coupling is that of the upright body everywhere.
  EXPECT_NEAR(report.pairs[0].smallest, report.pairs[0].largest, 1e-8);
  EXPECT_NEAR(0.746479, report.pairs[0].largest, 1e-6);
  EXPECT_EQ(ContactClass::kOrderDependent, report.pairs[0].worst);

  const auto pendulum = MakeModel("double_pendulum");
  const RegionReport stops = AssessRegion(*pendulum, pendulum->nominal().x, pendulum->nominal().u,
                                          Vector::Constant(4, 0.2), 20);
  EXPECT_EQ(ContactClass::kOrthogonal, stops.pairs[0].worst);
  EXPECT_GT(stops.largest_mass_condition, 1);
}

TEST(AssumptionsInARegion, AreRepeatableAndChecked) {
  const auto system = MakeModel("soft_biped");
  const Vector x = system->nominal().x, width = Vector::Constant(14, 0.1);
  const RegionReport once = AssessRegion(*system, x, Vector(0), width, 10, 4);
  const RegionReport again = AssessRegion(*system, x, Vector(0), width, 10, 4);
  EXPECT_EQ(once.pairs[0].met, again.pairs[0].met);
  EXPECT_EQ(once.pairs[0].largest, again.pairs[0].largest);
  EXPECT_THROW(AssessRegion(*system, x, Vector(0), Vector::Ones(3), 10), std::invalid_argument);
  EXPECT_THROW(AssessRegion(*system, x, Vector(0), -width, 10), std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
