// SPDX-License-Identifier: BSD-3-Clause
// Feedbacks once a step: of maps whose best law is known, and of a trot that lands on both feet.
#include "contact_flow/piecewise_linear/stabilizing_feedback.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/analysis/step_feedback.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/adversary/rescaled_system.h"
#include "test/analysis/random_conewise.h"

namespace contact_flow {
namespace {

/// x⁺ = right·x + w for x ≥ 0, left·x + w for x ≤ 0.
PiecewiseLinearMap DrivenOnTheLine(double left, double right) {
  Matrix L(1, 2), R(1, 2);
  L << left, 1;
  R << right, 1;
  const Matrix normal = Eigen::RowVector2d(1, 0);
  return PiecewiseLinearMap({{L, -normal, {}, {}, {}}, {R, normal, {}, {}, {}}});
}

TEST(StabilizingFeedback, OfTheLineIsHalfOfTheKink) {
  // |right + K| and |left + K| are smallest in the middle: half of their difference.
  const StabilizingFeedback found = FindStabilizingFeedback(DrivenOnTheLine(1.2, 2.4));
  EXPECT_TRUE(found.certified) << found.message;
  EXPECT_NEAR(0.6, found.rate, 1e-3);
  EXPECT_NEAR(-1.8, found.law.pieces().front().matrix(0, 0), 1e-3);
  EXPECT_TRUE(VerifyCertificate(found.closed, found.certificate));
}

TEST(StabilizingFeedback, ThatMustHaveAKink) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const StabilizingFeedback linear = FindStabilizingFeedback(DrivenOnTheLine(-3, 3));
  EXPECT_FALSE(linear.certified);
  EXPECT_NEAR(3, linear.rate, 1e-2);
  EXPECT_NE(std::string::npos, linear.message.find("no certificate")) << linear.message;
  FeedbackOptions options;
  options.piecewise = true;
  const StabilizingFeedback kinked = FindStabilizingFeedback(DrivenOnTheLine(-3, 3), options);
  ASSERT_TRUE(kinked.certified) << kinked.message;
  EXPECT_LT(kinked.rate, 1e-3);
  EXPECT_NEAR(-3, kinked.law(Vector::Ones(1))(0), 1e-3);
  EXPECT_NEAR(-3, kinked.law(-Vector::Ones(1))(0), 1e-3);
}

/// A x + B w + Σ_h a_h |c_h x + d_h w| with as many inputs as states: four pieces, whose kinks the
/// inputs can take away.
TEST(StabilizingFeedback, HasAKinkOnEachFace) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  std::mt19937 generator(9);
  const Matrix linear = 2 * test::RandomMatrix(2, 4, &generator) +
                        2 * Matrix(Eigen::Matrix<double, 2, 4>::Identity().rowwise().reverse());
  const Matrix jumps = test::RandomMatrix(2, 2, &generator);
  Matrix rows = test::RandomMatrix(2, 4, &generator);
  rows.row(0).tail(2).setZero();
  rows.row(1).tail(2) *= 0.2;
  rows.rowwise().normalize();
  std::vector<LinearPiece> pieces;
  for (const Eigen::Vector2d& sides : {Eigen::Vector2d(1, 1), Eigen::Vector2d(1, -1),
                                       Eigen::Vector2d(-1, 1), Eigen::Vector2d(-1, -1)}) {
    LinearPiece piece;
    piece.cone = sides.asDiagonal() * rows;
    piece.matrix = linear + 2 * jumps * piece.cone;
    pieces.push_back(piece);
  }
  const PiecewiseLinearMap step(pieces);
  const StabilizingFeedback one = FindStabilizingFeedback(step);
  FeedbackOptions options;
  options.piecewise = true;
  const StabilizingFeedback many = FindStabilizingFeedback(step, options);
  ASSERT_TRUE(many.certified) << many.message;
  EXPECT_TRUE(VerifyCertificate(many.closed, many.certificate));
  EXPECT_EQ(4u, many.law.pieces().size());
  EXPECT_LT(many.rate, 0.5 * one.rate) << one.rate;
  // By iterating the step itself.
  Vector x = Eigen::Vector2d(1, -2);
  for (int k = 0; k < 40; ++k) {
    Vector z(4);
    z << x, many.law(x);
    x = step(z);
  }
  EXPECT_LT(x.norm(), 2 * std::sqrt(5) * std::pow(many.certificate.bound, 20) + 1e-12);
}

TEST(StabilizingFeedback, OfALinearMapIsAsGoodAsItsUncontrollablePart) {
  // x₁⁺ = 2 x₁ + w, x₂⁺ = 0.7 x₂, in skew coordinates.
  std::mt19937 generator(5);
  const Matrix T = test::RandomMatrix(2, 2, &generator);
  Matrix step(2, 3);
  step.leftCols(2) = T * Eigen::Vector2d(2, 0.7).asDiagonal() * T.inverse();
  step.col(2) = 1e-3 * T.col(0);
  const StabilizingFeedback found = FindStabilizingFeedback(PiecewiseLinearMap::Linear(step));
  EXPECT_TRUE(found.certified) << found.message;
  EXPECT_NEAR(0.7, found.rate, 1e-3);
  step.col(2).setZero();
  const StabilizingFeedback none = FindStabilizingFeedback(PiecewiseLinearMap::Linear(step));
  EXPECT_FALSE(none.certified);
  EXPECT_NE(std::string::npos, none.message.find("unstable")) << none.message;
}

TEST(StabilizingFeedback, RefusesWhatIsNoStep) {
  EXPECT_THROW(FindStabilizingFeedback(PiecewiseLinearMap::Linear(Matrix::Ones(2, 2))),
               std::invalid_argument);
  const Matrix normal = Eigen::RowVector2d(1, 0);
  const PiecewiseLinearMap half({{Matrix::Ones(1, 2), normal, {}, {}, {}}});
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const StabilizingFeedback none = FindStabilizingFeedback(half);
  EXPECT_FALSE(none.certified);
  EXPECT_NE(std::string::npos, none.message.find("no feedback")) << none.message;
}

/// The trot on a narrow stance, with a torque that is set at each apex.
struct NarrowTrot {
  std::unique_ptr<MechanicalSystem> system;
  Section section;
  PoincareReturn orbit;
  ReducedMap step;
  StepFeedback feedback;

  explicit NarrowTrot(double hip_offset = 0.25)
      : system(MakeModel("steered_trot", {{"hip_offset", hip_offset}})),
        section(Section::Apex(*system, "body_z")) {
    const NominalRun& nominal = system->nominal();
    PoincareOptions options;
    options.derivative.variables.inputs = true;
    orbit = PoincareMap(*system, nominal.u, section, options).Return(nominal.x);
    step = ControlledReturn(*system, orbit, Horizontal(), {0});
    feedback = {nominal.x, nominal.u, step.basis, {0}, {}};
  }

  /// A shift of body and feet, and its rate.
  static Matrix Horizontal() {
    Matrix horizontal = Matrix::Zero(14, 2);
    horizontal.block(0, 0, 3, 1).setOnes();
    horizontal.block(7, 1, 3, 1).setOnes();
    return horizontal;
  }
  adversary::Units UnitsOf(double length, double time) const {
    adversary::Units units = adversary::Units::Same(7, system->num_constraints());
    units.length.head(6) *= length;
    units.gap *= length;
    units.time = time;
    return units;
  }
  /// The same step in other units of length and time.
  ReducedMap StepIn(double length, double time) const {
    const adversary::Units units = UnitsOf(length, time);
    const adversary::RescaledSystem rescaled(*system, units);
    PoincareOptions options;
    options.horizon *= time;
    options.shortest *= time;
    options.simulate = units.Scale(options.simulate);
    options.derivative.variables.inputs = true;
    const NominalRun& nominal = system->nominal();
    return ControlledReturn(
        rescaled, PoincareMap(rescaled, nominal.u, section, options).Return(units.State(nominal.x)),
        Horizontal(), {0});
  }
  Vector At(const Vector& z) const { return system->Perturb(feedback.x, step.basis * z); }
  FollowedOrbit Run(const Vector& z, int count) const {
    return Follow(*system, section, feedback, At(z), count, {}, 10);
  }
};

/// The same trot in other units of length and time: one rate, one law.
TEST(StabilizingFeedback, OfTheNarrowTrotIsOneInAllUnits) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const NarrowTrot trot;
  FeedbackOptions settings;
  settings.piecewise = true;
  const StabilizingFeedback natural = FindStabilizingFeedback(trot.step.map, settings);
  const Matrix gains = natural.law.pieces().front().matrix * trot.step.basis.transpose();
  for (const auto& [length, time] : std::vector<std::pair<double, double>>{
           {1e-3, std::sqrt(1e-3)}, {1e-4, 1}, {1e-4, 1e-2}, {1e3, 1}, {1, 1e3}}) {
    SCOPED_TRACE(testing::Message() << "length " << length << ", time " << time);
    const ReducedMap step = trot.StepIn(length, time);
    const StabilizingFeedback found = FindStabilizingFeedback(step.map, settings);
    ASSERT_TRUE(found.certified) << found.message;
    EXPECT_TRUE(VerifyCertificate(found.closed, found.certificate));
    EXPECT_NEAR(natural.rate, found.rate, 1e-6);
    const adversary::Units units = trot.UnitsOf(length, time);
    Vector sizes(14);
    sizes << units.length, units.length / time;
    const Matrix back = found.law.pieces().front().matrix * step.basis.transpose() *
                        sizes.asDiagonal() * trot.step.basis;
    EXPECT_LE((back - gains * trot.step.basis).norm(), 1e-6 * gains.norm());
  }
}

double LargestModulus(const PiecewiseLinearMap& closed) {
  double largest = 0;
  for (const LinearPiece& piece : closed.pieces()) {
    largest = std::max(largest, piece.matrix.eigenvalues().cwiseAbs().maxCoeff());
  }
  return largest;
}

/// One gain for both pieces contracts as fast as any that was ever found, from wherever descents
/// begin: in other units, and on a stance on which all first descents end with a loop that grows.
TEST(StabilizingFeedback, OfOneGainIsTheBestOfManyDescents) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const NarrowTrot trot, narrower(0.2);
  const struct {
    const ReducedMap step;
    double modulus;  // the smallest of a thousand descents
  } cases[] = {{trot.step, 0.75812},
               {trot.StepIn(1e-3, std::sqrt(1e-3)), 0.75812},
               {trot.StepIn(1, 1e3), 0.75812},
               {narrower.step, 0.78228}};
  for (const auto& c : cases) {
    const StabilizingFeedback found = FindStabilizingFeedback(c.step.map);
    ASSERT_TRUE(found.certified) << found.message;
    EXPECT_TRUE(VerifyCertificate(found.closed, found.certificate));
    EXPECT_NEAR(c.modulus, LargestModulus(found.closed), 2e-3 * c.modulus);
  }
}

/// Unit directions, the same in each run.
std::vector<Vector> Directions(int count, int n) {
  std::mt19937 generator(7);
  std::vector<Vector> all;
  for (int k = 0; k < count; ++k) {
    all.push_back(test::RandomMatrix(n, 1, &generator).normalized());
  }
  return all;
}

TEST(StabilizingFeedback, OfTheNarrowTrot) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  NarrowTrot trot;
  ASSERT_EQ(2u, trot.step.map.pieces().size());
  EXPECT_LT(trot.step.residual, 1e-8);
  // Without: what test/data/hopping_trot_unstable.json says of hopping_trot.
  const StabilityReport without =
      AssessStability(ClosedLoop(trot.step.map, PiecewiseLinearMap::Linear(Matrix::Zero(1, 11))));
  EXPECT_EQ(StabilityVerdict::kUnstable, without.verdict);
  EXPECT_NEAR(35.3356, without.growth_below, 1e-3);

  // A gain for both pieces, and one for each. In one norm no common gain contracts; the words of
  // pieces that do follow one another do.
  const struct {
    bool piecewise;
    StabilityTest test;
    double size;  // of the perturbations, [m], [rad], [m/s] and [rad/s] together
  } cases[] = {{false, StabilityTest::kWords, 1e-5}, {true, StabilityTest::kQuadraticNorm, 1e-2}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.piecewise);
    FeedbackOptions options;
    options.piecewise = c.piecewise;
    const StabilizingFeedback found = FindStabilizingFeedback(trot.step.map, options);
    ASSERT_TRUE(found.certified) << found.message;
    EXPECT_EQ(c.test, found.certificate.test);
    EXPECT_TRUE(VerifyCertificate(found.closed, found.certificate));
    EXPECT_EQ(c.piecewise ? 2u : 1u, found.law.pieces().size());
    trot.feedback.law = found.law;

    // The closed loop's pieces are the derivative of the controlled map: quotients of its
    // simulations approach them by the step, on either side of the kink.
    for (const Vector& z : Directions(6, 11)) {
      double errors[2];
      for (int k = 0; k < 2; ++k) {
        const double alpha = k == 0 ? 1e-5 : 1e-6;
        const FollowedOrbit one = trot.Run(alpha * z, 1);
        ASSERT_EQ(2u, one.x.size()) << one.message;
        const Vector quotient = trot.feedback.Deviation(*trot.system, one.x[1]) / alpha;
        errors[k] = (quotient - found.closed(z)).norm();
      }
      EXPECT_LT(errors[1], 0.2 * errors[0] + 1e-5) << z.transpose();
    }
    // 50 periods from 20 perturbed starts.
    for (const Vector& z : Directions(20, 11)) {
      const FollowedOrbit run = trot.Run(c.size * z, 50);
      ASSERT_EQ(51u, run.x.size()) << run.message;
      EXPECT_LT(run.away.back(), 1e-2 * c.size) << z.transpose();
    }
  }

  // Without a feedback they are lost.
  trot.feedback.law = PiecewiseLinearMap::Linear(Matrix::Zero(1, 11));
  int lost = 0;
  for (const Vector& z : Directions(20, 11)) {
    const FollowedOrbit run = trot.Run(1e-5 * z, 50);
    lost += run.x.size() < 51 || run.away.back() > 1;
  }
  EXPECT_EQ(20, lost);
}

}  // namespace
}  // namespace contact_flow
