// SPDX-License-Identifier: BSD-3-Clause
// Directions in which contacts in space begin to slip, beside light parts: roots of (F5) that are
// next to its poles.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <random>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {
namespace {

class DrawnSlips {
 public:
  explicit DrawnSlips(unsigned seed) : random_(seed) {}

  double Normal() { return normal_(random_); }
  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double Power(double low, double high) { return std::pow(10.0, Between(low, high)); }

  /// Of one contact, with a condition up to 1e8, and in any units.
  FrictionProblem One() {
    Matrix A(3, 3);
    for (double& entry : A.reshaped()) entry = Normal();
    const Matrix Q = Eigen::HouseholderQR<Matrix>(A).householderQ();
    const double range = Between(-8, 0);
    Vector stiff(3);
    stiff << 1, Power(range, 0), Power(range, 0);
    FrictionProblem problem;
    problem.G = Power(-6, 6) * Q * stiff.asDiagonal() * Q.transpose();
    problem.G = (0.5 * (problem.G + problem.G.transpose())).eval();
    problem.b.resize(3);
    for (double& entry : problem.b) entry = Normal() * Power(-3, 1);
    problem.b(0) = -std::abs(problem.b(0));
    problem.b *= Power(-6, 6);
    FrictionContact contact;
    contact.coefficient = Power(-3, 3);
    contact.dimension = 2;
    problem.contacts.push_back(contact);
    return problem;
  }

  /// Of several, each of which pushes a light part in one direction, or in two.
  FrictionProblem WithLightParts(int contacts) {
    const int size = 3 * contacts;
    Matrix A(size, 6);
    for (double& entry : A.reshaped()) entry = Normal();
    FrictionProblem problem;
    problem.G = A * A.transpose() / 6;
    for (int i = 0; i < contacts; ++i) {
      Matrix light(3, 1 + i % 2);
      for (double& entry : light.reshaped()) entry = Normal();
      problem.G.block<3, 3>(3 * i, 3 * i) += Power(1, 4) * light * light.transpose();
      FrictionContact contact;
      contact.coefficient = Between(0.1, 1.5);
      contact.dimension = 2;
      problem.contacts.push_back(contact);
    }
    return problem;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// One contact that slips along d: its normal force, and D times what (F5) says, for D = G_nn −
/// μ G_nt · d; by y_n = 0.
struct SlipAt {
  SlipAt(const FrictionProblem& problem, double psi) {
    const Eigen::Vector2d d(std::cos(psi), std::sin(psi));
    const double mu = problem.contacts[0].coefficient;
    const Eigen::Vector2d pull = -mu * d;
    const double D = problem.G(0, 0) + problem.G.block<1, 2>(0, 1).dot(pull);
    force.resize(3);
    force << -problem.b(0) / D, -problem.b(0) / D * pull;
    const Eigen::Vector2d slip = D * problem.b.tail<2>() -
                                 problem.b(0) * problem.G.col(0).tail<2>() -
                                 problem.b(0) * problem.G.bottomRightCorner<2, 2>() * pull;
    determinant = D / (problem.G(0, 0) + mu * problem.G.block<1, 2>(0, 1).norm());
    across = d(0) * slip(1) - d(1) * slip(0);
    along = d.dot(slip) / D;
  }
  Vector force;
  double across, along;
  double determinant;  // D, relative to its largest
};

/// Every slip that bisection between 20 000 directions finds is among the solutions, and every
/// solution that slips is one of them.
TEST(SlipDirections, OfOneContactAreAllFound) {
  DrawnSlips draw(1);
  constexpr int kFine = 20000;
  const double step = 2 * M_PI / kFine;
  int slips = 0, near_pole = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const FrictionProblem problem = draw.One();
    const double scale = problem.b.cwiseAbs().maxCoeff();
    std::vector<Vector> all, certain;
    double before = SlipAt(problem, -step).across;
    for (int k = 0; k < kFine; ++k) {
      const double value = SlipAt(problem, k * step).across;
      double low = (k - 1) * step, high = k * step;
      const bool crosses = (before < 0) != (value < 0);
      for (int halving = 0; halving < 60 && crosses; ++halving) {
        const double middle = 0.5 * (low + high);
        ((SlipAt(problem, middle).across < 0) == (before < 0) ? low : high) = middle;
      }
      before = value;
      if (!crosses) continue;
      const SlipAt root(problem, high);
      all.push_back(root.force);
      if (!(problem.G(0, 0) * root.force(0) > 1e-4 * scale && root.along > 1e-4 * scale)) continue;
      certain.push_back(root.force);
      near_pole += std::abs(root.determinant) < 1e-2;
    }
    const auto solutions = SolveFriction(problem);
    const auto nearest = [](const Vector& force, const auto& others) {
      double least = 1;
      for (const Vector& other : others) {
        least = std::min(least, (force - other).norm() / force.norm());
      }
      return least;
    };
    std::vector<Vector> found;
    for (const FrictionSolution& s : solutions) {
      EXPECT_FALSE(s.springs) << "trial " << trial;
      if (s.letters[0] != Letter::kSlip) continue;
      found.push_back(s.force);
      EXPECT_LT(nearest(s.force, all), 1e-5) << "trial " << trial;
    }
    for (const Vector& force : certain) EXPECT_LT(nearest(force, found), 1e-5) << "trial " << trial;
    slips += static_cast<int>(certain.size());
  }
  EXPECT_GT(slips, 150);
  EXPECT_GT(near_pole, 10);
}

/// Made from a solution, b = y − G λ: that one is found, in which all slip.
TEST(SlipDirections, OfContactsOnLightPartsAreThoseTheyWereMadeOf) {
  DrawnSlips draw(2);
  for (int trial = 0; trial < 200; ++trial) {
    const int contacts = 1 + trial % 2;
    FrictionProblem problem = draw.WithLightParts(contacts);
    Vector force(3 * contacts), rate(3 * contacts);
    for (int i = 0; i < contacts; ++i) {
      const double psi = draw.Between(0, 2 * M_PI), size = draw.Between(0.3, 1);
      const Eigen::Vector2d d(std::cos(psi), std::sin(psi));
      force.segment<3>(3 * i) << size, -size * problem.contacts[i].coefficient * d;
      rate.segment<3>(3 * i) << 0, draw.Between(0.3, 1) * d;
    }
    problem.b = rate - problem.G * force;
    double nearest = 1;
    for (const FrictionSolution& s : SolveFriction(problem)) {
      EXPECT_FALSE(s.springs) << "trial " << trial;
      nearest = std::min(nearest, (s.force - force).norm() / force.norm());
    }
    EXPECT_LT(nearest, 1e-8) << "trial " << trial;
  }
}

}  // namespace
}  // namespace contact_flow
