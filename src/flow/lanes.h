// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace contact_flow {

/// What a LaneStepper works on. Arrays are [rows × width], the lanes of a row side by side.
struct LaneArrays {
  int width = 0;                   ///< W, lanes
  double* h = nullptr;             ///< [W] length of the step to try [s]
  double* x = nullptr;             ///< where steps begin [2d]
  double* end = nullptr;           ///< where the one tried last ends [2d]
  double* stages = nullptr;        ///< derivatives, 16 × [2d]
  double* forces = nullptr;        ///< λ at the stages, 16 × [n]
  double* errors = nullptr;        ///< local errors, to be scaled by `factor` [2d]
  double* factor = nullptr;        ///< [W]
  double* error = nullptr;         ///< [W] scaled, acceptable when ≤ 1
  double* stiffness = nullptr;     ///< [W] h |λ| of the dominant eigenvalue
  double* gap = nullptr;           ///< at the end [n]
  double* rate = nullptr;          ///< at the end [n]
  double* acceleration = nullptr;  ///< of the gaps at the end [n]
  double* dense = nullptr;         ///< coefficients of the extension, 8 × [2d]
  double* u = nullptr;             ///< inputs [m]
  double* low = nullptr;           ///< the least force of the stages and the end [n]
  double* high = nullptr;          ///< the largest
  double* sum = nullptr;           ///< [W] finite where the step is
  double* tally = nullptr;         ///< what the errors of accepted steps add up to [2d]
  double* accept = nullptr;        ///< [W] 1: Advance takes the step, 0: it does not
};

/// DOP853 for W runs of one model at a time, each from its own point, by its own step and in its
/// own contact mode: the numbers of Dop853, ContactDynamics and SampleGaps, lane by lane, to the
/// bit. Of models with constant M and Da alone, and without friction.
class LaneStepper {
 public:
  virtual ~LaneStepper() = default;

  const LaneArrays& arrays() const { return arrays_; }
  /// P_J [d×d] and Λ_J A_J M⁻¹ [n×d], rows of zeros off J, columns one after the other: the mode of
  /// a lane.
  virtual void SetMaps(int lane, const double* inverse, const double* force_map) = 0;
  /// All but the field at the end, which Finish evaluates.
  virtual void TryStep(double relative_tolerance, double absolute_tolerance) = 0;
  virtual void Finish() = 0;
  virtual void Extend() = 0;
  /// The ends of the accepted steps become the beginnings of the next; their errors are added, as
  /// ErrorTally does.
  virtual void Advance() = 0;

 protected:
  LaneArrays arrays_;
};

/// What makes one, of the constant Da [n×d] and the values of the model's parameters.
using LaneStepperMaker = LaneStepper* (*)(const double* jacobian, const double* parameters);
/// That of a model by name, for 4 lanes of AVX2; nullptr where it has none.
LaneStepperMaker FindLanesAvx2(const char* model);
/// The same for 8 lanes of AVX-512.
LaneStepperMaker FindLanesAvx512(const char* model);

}  // namespace contact_flow
