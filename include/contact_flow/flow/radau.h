// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include "contact_flow/flow/radau_rule.h"
#include "contact_flow/flow/stepper.h"
#include "contact_flow/model/configuration_space.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Radau IIA: implicit, L-stable, order 5 or 9, for q̇ = N(q) v, v̇ = a(q, v), whose forces may be as
/// stiff as they like: a step is as long as the motion is smooth (Hairer & Wanner II, Sec. IV.8).
///
/// Stages are solved for by Newton's method with the Jacobian of the point where the step begins,
/// in one real and (s−1)/2 complex factors of order d (StageSolver); they start from the extension
/// of the step before. The error of a step is that of its extension, of order s + 1, which is what
/// guards and tangents see: it is told by the defect of the extension at two places between the
/// stages. The end is far more accurate: of order 2s − 1.
///
/// The field is called s times in an iteration of Newton's method, twice for the error, once by
/// Begin and by Finish.
class Radau final : public Stepper {
 public:
  /// Writes F(x) [nq+d] to `xdot`. `place` is that of StagePlaces, the last call of each counts.
  using Field = std::function<void(int place, const double* x, double* xdot)>;
  /// Writes D a = [K D] [d×2d] by tangents (η, δv), δq = N η.
  using Jacobian = std::function<void(const Vector& x, Matrix* jacobian)>;

  /// s = 3 or 5 stages. The space must outlive this.
  Radau(const ConfigurationSpace& space, int stages, Field field, Jacobian jacobian);
  ~Radau() override;

  void Begin(const Vector& x) override;
  double GuessStep(double relative_tolerance, double absolute_tolerance) override;
  double TryStep(double h, double relative_tolerance, double absolute_tolerance) override;
  void Finish() override;
  void Extend() override;
  void Advance() override;
  void Restart() override { tried_ = false; }
  double Growth(double error) const override;

  /// h ρ(DF) where the last accepted step began: below about 2 an explicit step is as long.
  double Stiffness();
  long jacobians() const { return jacobians_; }   ///< so far
  int iterations() const { return iterations_; }  ///< of the last step tried

 private:
  struct Solvers;

  void FindJacobian();
  void Factor(double h);
  void Predict(double h);
  bool Iterate(double h, double relative_tolerance);
  void Correct(double h);
  double EstimateError(double h, double relative_tolerance, double absolute_tolerance);
  double Norm(const Vector& change) const;
  double Fail();
  double Stay();

  const ConfigurationSpace& space_;
  const RadauRule& rule_;
  const Field field_;
  const Jacobian jacobian_at_;
  const std::unique_ptr<Solvers> solvers_;
  const int d_;
  const int end_place_;
  Vector begin_slope_, end_slope_;  // F at both ends [n]
  Matrix jacobian_;                 // [K D] at the point
  bool jacobian_known_ = false;
  double factored_ = 0;  // the step for which the factors are
  bool tried_ = false;   // Z_ and dense_ are of a step from this point
  Matrix Z_;             // stages less x [n×s]
  Matrix F_;             // F there [n×s]
  Matrix change_;        // of Z_, by the last iteration [n×s]
  Vector rho_;           // see RadauRule [n]
  Vector scale_;         // of errors [n]
  Vector stage_, slope_;
  // What the steps before tell.
  bool has_last_ = false;
  double last_step_ = 0, last_error_ = 1;
  Vector last_dense_, last_point_;
  double contraction_ = 1, last_contraction_ = 1;
  double error_ = 0;
  int iterations_ = 0;
  long jacobians_ = 0;
};

}  // namespace contact_flow
