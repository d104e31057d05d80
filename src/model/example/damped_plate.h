// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A plate on a table, and two carts driven into their stops at once. A damper ties each cart to
/// the plate by a lever of ratio r_k, so that each impact changes the force on the table by a jump:
///   λ_table = weight − Σ_k damping (r_k ẋ_k − ż),
/// where cart k contributes drive/r_k before its impact and −restitution·drive/r_k after it. By the
/// signs of r_k and of the weight (of the plate, less its counterweight) the table's contact keeps
/// through both impacts, lets go between them and is regained, or is released by them.
struct DampedPlate {
  static constexpr const char* kName = "damped_plate";
  static constexpr const char* kSummary =
      "impacts of two carts change the force under a plate: it lets go after one, regained at the "
      "other";
  static constexpr int kDof = 3, kConstraints = 3, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 3> kCoordinates = {"plate_z", "first_x", "second_x"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 3> kConstraintNames = {"table", "first_stop",
                                                                  "second_stop"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P plate_mass = 1, cart_mass = 1, weight = 1, drive = 1.2, damping = 1.2;
    P ratio_first = 0.75, ratio_second = -0.6, restitution = 0.5;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(plate_mass, "plate_mass", "kg", "mass of the plate", Range::kPositive);
      visit(cart_mass, "cart_mass", "kg", "mass of each cart", Range::kPositive);
      visit(weight, "weight", "N", "weight of the plate less its counterweight", Range::kAny);
      visit(drive, "drive", "N", "force that drives each cart to its stop", Range::kPositive);
      visit(damping, "damping", "N s/m", "of each damper, at the plate", Range::kPositive);
      visit(ratio_first, "ratio_first", "", "lever from first cart to plate; not 0", Range::kAny);
      visit(ratio_second, "ratio_second", "", "lever from second cart to plate; not 0",
            Range::kAny);
      visit(restitution, "restitution", "", "restitution of the stops", Range::kUnitInterval);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(0, 0) = S(p.plate_mass);
    (*M)(1, 1) = (*M)(2, 2) = S(p.cart_mass);
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    const S first = p.damping * (p.ratio_first * v(1) - v(0));
    const S second = p.damping * (p.ratio_second * v(2) - v(0));
    (*f)(0) = first + second - p.weight;
    (*f)(1) = -p.ratio_first * first - p.drive;
    (*f)(2) = -p.ratio_second * second - p.drive;
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 3, 1>* a) {
    *a = q;
  }

  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return i == 0 ? P(0.0) : p.restitution;
  }

  /// The plate rests, the carts run at the speed where drive and damper balance, and both meet
  /// their stops after 0.2 s.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    constexpr double kMeet = 0.2;
    const double first = Speed(p, p.ratio_first), second = Speed(p, p.ratio_second);
    NominalRun run;
    run.x.resize(6);
    run.x << 0, first * kMeet, second * kMeet, 0, -first, -second;
    run.u = Vector::Zero(0);
    run.duration = 0.4;
    return run;
  }

 private:
  template <class P>
  static double Speed(const Parameters<P>& p, double ratio) {
    return ratio != 0 ? p.drive / (p.damping * ratio * ratio) : 1;
  }
};

}  // namespace example
}  // namespace contact_flow
