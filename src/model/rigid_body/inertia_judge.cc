// SPDX-License-Identifier: BSD-3-Clause
#include "inertia_judge.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <sstream>

namespace contact_flow {
namespace {

/// Decimal numbers of a thin plate are off by this share of the sum of its moments.
constexpr double kPlate = 1e-6;
/// Computed zero moments are off by this share of the largest one.
constexpr double kRounding = 1e-9;
/// A body smaller than this is a point, whatever its inertia [m].
constexpr double kSmallestArm = 1e-6;

Mat3<double> SecondMoments(const Mat3<double>& central) {
  return 0.5 * central.trace() * Mat3<double>::Identity() - central;
}

/// How negative the smallest moment is beside the largest; 0 for none.
double Indefinite(const Mat3<double>& central) {
  const Vec3<double> moments = Eigen::SelfAdjointEigenSolver<Mat3<double>>(central).eigenvalues();
  return moments(0) < 0 ? -moments(0) / moments.cwiseAbs().maxCoeff() : 0;
}

std::string Moments(const Mat3<double>& central) {
  const Vec3<double> moments = Eigen::SelfAdjointEigenSolver<Mat3<double>>(central).eigenvalues();
  std::ostringstream text;
  text.precision(4);
  text << moments(0) << ", " << moments(1) << ", " << moments(2);
  return text.str();
}

}  // namespace

double InertiaDefect(const Mat3<double>& central) {
  if (central.isZero(0)) return 0;
  const double lowest =
      Eigen::SelfAdjointEigenSolver<Mat3<double>>(SecondMoments(central)).eigenvalues()(0);
  if (lowest >= 0) return 0;
  // Of S the lowest eigenvalue is half of what the others lack to the largest moment.
  return central.trace() > 0 ? std::min(1., -2 * lowest / central.trace()) : 1;
}

Mat3<double> NearestInertia(const Mat3<double>& central) {
  const Eigen::SelfAdjointEigenSolver<Mat3<double>> solver(SecondMoments(central));
  const Vec3<double> clipped = solver.eigenvalues().cwiseMax(0);
  const Mat3<double> moments =
      solver.eigenvectors() * clipped.asDiagonal() * solver.eigenvectors().transpose();
  return moments.trace() * Mat3<double>::Identity() - moments;
}

void JudgeInertias(UrdfFaults faults, RobotModel* robot, Findings* findings) {
  std::vector<BodyInertia> bodies(robot->tree.num_bodies());
  for (const RobotModel::Link& link : robot->links) {
    if (link.body >= 0) bodies[link.body] = bodies[link.body] + link.inertia.In(link.pose);
  }
  const bool strict = faults == UrdfFaults::kStrict;
  for (RobotModel::Link& link : robot->links) {
    if (link.body < 0) continue;
    const Mat3<double> given = link.inertia.central;
    const std::string owner = "link '" + link.name + "'";
    if (Indefinite(bodies[link.body].central) > kRounding && Indefinite(given) > kRounding) {
      const bool tiny = given.norm() < kSmallestArm * kSmallestArm * link.inertia.mass;
      if (strict || !(tiny || Indefinite(given) <= kMaxInertiaRepair)) {
        findings->errors.push_back(owner +
                                   ": its inertia is not positive definite: its principal "
                                   "moments are " +
                                   Moments(given) + " [kg m^2]; correct <inertia>");
        continue;
      }
      link.inertia.central = NearestInertia(given);
      findings->warnings.push_back(owner +
                                   ": its inertia is not positive definite; its principal "
                                   "moments " +
                                   Moments(given) +
                                   " were replaced by the nearest ones that a body can have, " +
                                   Moments(link.inertia.central) + " [kg m^2]");
      continue;
    }
    const double defect = InertiaDefect(given);
    if (InertiaDefect(bodies[link.body].central) <= kPlate || defect <= kPlate) continue;
    const std::string complaint =
        owner + ": no body has its inertia: the largest of its principal moments " +
        Moments(given) + " [kg m^2] is more than the sum of the others";
    if (strict) {
      findings->errors.push_back(complaint + "; correct <inertia>");
    } else {
      findings->warnings.push_back(complaint + "; it is used as it is");
    }
  }
}

}  // namespace contact_flow
