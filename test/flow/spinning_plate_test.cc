// SPDX-License-Identifier: BSD-3-Clause
// A box that spins on one of its faces, turned as a run leaves it, up to rounding. Its four corners
// are dependent, two of a diagonal can carry it alone, and nothing but rounding tells which.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

class SpinningPlate : public ::testing::Test {
 protected:
  /// At rest on a face, but for its spin; tilted by `tilt`, its rates wrong by `noise`.
  Vector State(double tilt, double noise, double spin) {
    std::normal_distribution<double> normal;
    const double half = std::sqrt(0.5);
    const std::vector<Eigen::Quaternion<double>> faces = {
        {1, 0, 0, 0}, {0, 1, 0, 0}, {half, half, 0, 0}, {half, -half, 0, 0}, {half, 0, half, 0}};
    const Eigen::Vector3d axis = Eigen::Vector3d(normal(dice_), normal(dice_), 1).normalized();
    const Eigen::Quaternion<double> turned =
        Eigen::Quaternion<double>(Eigen::AngleAxis<double>(tilt, axis)) *
        Eigen::Quaternion<double>(
            Eigen::AngleAxis<double>(normal(dice_), Eigen::Vector3d::UnitZ())) *
        faces[dice_() % faces.size()];
    Vector x = Vector::Zero(13);
    x.segment<4>(3) << turned.w(), turned.x(), turned.y(), turned.z();
    x.segment<4>(3).normalize();
    for (int i = 7; i < 13; ++i) x(i) = noise * normal(dice_);
    x(7) += 1e-3;
    x.tail<3>() += turned.conjugate() * Eigen::Vector3d(0, 0, spin);
    ConstraintTerms terms;
    system_->Constraints(x.head(7), x.tail(6), &terms);
    x(2) -= terms.gap.minCoeff();
    return x;
  }

  std::mt19937 dice_{1};
  std::unique_ptr<MechanicalSystem> system_ = MakeModel("falling_box");
};

TEST_F(SpinningPlate, StandsOnThreeOfItsCorners) {
  std::uniform_real_distribution<double> digits(8, 17);
  for (int trial = 0; trial < 400; ++trial) {
    const double tilt = std::pow(10, -digits(dice_)) / 10,
                 noise = std::pow(10, -digits(dice_)) / 10;
    const Vector x = State(tilt, noise, trial % 3);
    ContactMode mode;
    ASSERT_NO_THROW(mode = InitialMode(*system_, x, Vector::Zero(6))) << "trial " << trial;
    EXPECT_EQ(3, mode.Size()) << "trial " << trial;
  }
}

/// Nothing slows it: the angle is that of its spin.
TEST_F(SpinningPlate, SpinsOn) {
  for (int trial = 0; trial < 10; ++trial) {
    const Vector x = State(1e-15, 1e-15, 2);
    const Trajectory run = Simulate(*system_, x, Vector::Zero(6), 0.5);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    const Vector end = run.FinalState();
    const Eigen::Quaternion<double> before(x(3), x(4), x(5), x(6)),
        after(end(3), end(4), end(5), end(6));
    EXPECT_NEAR(1, before.angularDistance(after), 1e-9);
    EXPECT_NEAR(x(2), end(2), 1e-12);
    EXPECT_TRUE(run.transitions.empty());
  }
}

}  // namespace
}  // namespace contact_flow
