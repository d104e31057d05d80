// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/model/rigid_body/constraint_element.h"
#include "surface_motion.h"

namespace contact_flow {

/// A constraint against a surface of the world that is displaced by s(t): a(z, t) = a₀(y), y the
/// points less s. Its one joint is the clock, so that z is longer by t; the derivatives of a₀ are
/// carried over by
///   y = z − s,      ẏ = ż − ṡ ṫ,      ÿ = z̈ − s̈ ṫ² − ṡ ẗ,
/// and slip is that on the surface where it is then. What pushes the clock is the power that moves
/// the surface takes; its inertia has to be kDrivenInertia.
class MovingConstraint final : public ConstraintElement {
 public:
  /// `still` of points alone, all of which move with the world's; its numbers are followed by those
  /// of the motion (SurfaceMotion::Numbers).
  MovingConstraint(std::unique_ptr<ConstraintElement> still, SurfaceMotion motion,
                   const RobotModel::Coordinate& clock);
  /// Takes parts.numbers over, which have changed.
  void TakeNumbers();

  const ConstraintElement& still() const { return *still_; }
  const SurfaceMotion& motion() const { return motion_; }

  bool Touches() const override { return still_->Touches(); }
  bool MaySlip() const override { return still_->MaySlip(); }
  void AddFriction(const SlipFrame& frame) override;
  int size() const override { return clock() + 1; }
  bool IsAffine() const override { return still_->IsAffine() && motion_.IsUniform(); }
  double Gap(const double* z, double* gradient) const override;
  double Curvature(const double* z, const double* rate) const override;
  void Differentiate(const double* z, const double* rate, const double* acceleration, double lambda,
                     double* hessian, double* by_z, double* by_rate) const override;
  ByNumber DifferentiateByNumber(const double* z, const double* rate, const double* acceleration,
                                 int k, double* gradient) const override;
  bool IsSlipAffine() const override { return still_->IsSlipAffine() && motion_.IsUniform(); }
  void SlipMap(const double* z, double* map) const override;
  void SlipRate(const double* z, const double* rate, const double* acceleration,
                double* slip_rate) const override;
  void SlipHessian(const double* z, const double* lambda, double* hessian) const override;
  void DifferentiateSlip(const double* z, const double* rate, const double* acceleration,
                         double* rate_z, double* rate_rate, double* slip_z) const override;
  void DifferentiateSlipByNumber(const double* z, const double* rate, const double* acceleration,
                                 int k, double* map, double* slip_rate) const override;
  void Place(const double* z, Vec3<double>* arm, Vec3<double>* push) const override;
  std::vector<std::vector<double>> Knots() const override { return still_->Knots(); }
  void Across(const double* z, double* coordinates) const override;
  bool IsNarrow() const override { return still_->IsNarrow(); }
  SurfacePassage Passage(const double* z, const double* rate) const override;
  double NextKnot(double t) const override { return motion_.NextKnot(t); }

 private:
  struct Relative;
  template <class AtClock>
  void Widen(const double* rows, AtClock at_clock, double* wide) const;

  /// Where the clock stands in z: behind the points, before the turns.
  int clock() const { return 3 * static_cast<int>(parts.points.size()); }
  int slip_size() const { return parts.size(); }

  std::unique_ptr<ConstraintElement> still_;
  SurfaceMotion motion_;
};

}  // namespace contact_flow
