// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_nonlinearsolver.h>

#include <array>
#include <vector>

#include "hybrid_system.h"
#include "scenario.h"

namespace contact_flow {
namespace benchmark {

/// CVODES with Adams formulas, fixed-point iteration and rootfinding on the gaps; restarted at
/// events. Holds all memory, for the state alone or with 14 forward sensitivities.
class CvodesSolver {
 public:
  CvodesSolver(const Scenario& scenario, bool sensitivities);
  ~CvodesSolver();
  CvodesSolver(const CvodesSolver&) = delete;
  CvodesSolver& operator=(const CvodesSolver&) = delete;

  /// Starts at the scenario's initial state, sensitivities at the identity.
  void Begin(double tolerance);
  /// Integrates to the next gap that closes (true) or to the horizon (false).
  bool FlowToEvent();
  /// Goes on from the present state and sensitivities, as if from a new initial state.
  void Restart();

  HybridSystem& hybrid() { return hybrid_; }
  double t() const { return t_; }
  int trigger() const { return trigger_; }
  double* state() { return NV_DATA_S(state_); }
  Eigen::Map<Vector> sensitivity(int k) { return {NV_DATA_S(sensitivities_[k]), kStates}; }

 private:
  static int Field(realtype t, N_Vector x, N_Vector xdot, void* self);
  static int Gaps(realtype t, N_Vector x, realtype* gap, void* self);
  static int SensitivityField(int count, realtype t, N_Vector x, N_Vector xdot, N_Vector* s,
                              N_Vector* sdot, void* self, N_Vector scratch1, N_Vector scratch2);

  const Scenario& scenario_;
  const bool with_sensitivities_;
  HybridSystem hybrid_;
  SUNContext context_ = nullptr;
  void* memory_ = nullptr;
  N_Vector state_ = nullptr;
  N_Vector* sensitivities_ = nullptr;
  SUNNonlinearSolver solver_ = nullptr;
  SUNNonlinearSolver sensitivity_solver_ = nullptr;
  std::vector<int> roots_;
  std::vector<double> rates_;
  double t_ = 0;
  int trigger_ = -1;
};

}  // namespace benchmark
}  // namespace contact_flow
