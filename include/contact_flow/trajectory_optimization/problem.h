// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A run that is to be chosen. With inputs u_k held on the K intervals of a grid, of lengths h_k,
///   J = Σ_k h_k Σ_j r_j (u_kj − ū_j)² + Σ_k h_k Σ_i s_i (q_i(t_{k+1}) − p_i)²
///       + Σ_i w_i (x_i(T) − g_i)²,
/// x = (q, v) [nq+d]; no factor ½. Positions alone have a cost on the way: velocities jump, and a
/// cost at an instant of the grid would jump with the order of events.
struct TrajectoryProblem {
  Vector x;              ///< initial state [nq+d]
  InputSchedule inputs;  ///< grid [K], beginning at the start, and where to begin the search
  double duration = 0;   ///< T > the last instant [s]

  bool choose_inputs = true;        ///< the unknowns u_k
  std::vector<int> choose_initial;  ///< and tangents (q, v) of the initial state, by index < 2d

  Vector effort;           ///< r ≥ 0 [m]
  Vector input_reference;  ///< ū [m]; empty: 0
  Vector path_weight;      ///< s ≥ 0 [nq]; empty: none
  Vector path_target;      ///< p [nq]; empty: 0
  Vector weight;           ///< w ≥ 0 [nq+d]
  Vector target;           ///< g [nq+d]

  Vector lower;          ///< of the inputs [m]; empty: none
  Vector upper;          ///< as lower
  Vector initial_lower;  ///< of changes of the initial state; empty: none
  Vector initial_upper;  ///< as initial_lower

  SimulateOptions simulate;       ///< options of runs
  BDerivativeOptions derivative;  ///< options of derivatives; its variables are set by the search
  /// Events, and instants at which the input changes, closer than this count as one where the
  /// pieces of the cost are asked for [s].
  double kink_interval = 1e-6;

  /// Tight tolerances.
  TrajectoryProblem() {
    simulate.relative_tolerance = simulate.absolute_tolerance = 1e-12;
    simulate.simultaneity_tolerance = 1e-12;
    derivative.tolerance = 1e-11;
  }
};

/// The unknowns y = (u_1, …, u_K, δx) of a problem as one vector [n], and what they stand for.
/// `system` and `problem` must outlive it.
class Unknowns {
 public:
  /// Throws std::invalid_argument, naming the field, for sizes, signs and indices that are not
  /// right, and for a choice of an initial state that is in contact or whose positions are no ℝᵈ.
  Unknowns(const MechanicalSystem& system, const TrajectoryProblem& problem);

  /// n.
  int size() const { return size_; }
  /// The place of u_kj, or −1.
  int Input(std::size_t k, int j) const {
    return problem_.choose_inputs ? static_cast<int>(k) * inputs_ + j : -1;
  }
  /// The place of the i-th of choose_initial.
  int Initial(std::size_t i) const { return first_initial_ + static_cast<int>(i); }
  /// Values in the problem.
  Vector Start() const;
  /// Bounds of y, ±∞ where there are none [n].
  const Vector& lower() const { return lower_; }
  const Vector& upper() const { return upper_; }  ///< as lower
  /// The initial state at y [nq+d].
  Vector InitialState(const Vector& y) const;
  /// The inputs at y.
  InputSchedule Inputs(const Vector& y) const;
  /// The run at y; `simultaneity_tolerance` in place of the problem's, `dense` if it is to be
  /// differentiated.
  Trajectory Run(const Vector& y, double simultaneity_tolerance, bool dense) const;
  /// h_k [s].
  double Length(std::size_t k) const;
  /// J of a run, by its end and its states at the grid's instants. `positions` [nq × K]: q(t_k+1).
  double Cost(const Vector& y, const Matrix& positions, const Vector& end) const;
  /// q at the ends of the intervals [nq × K], and x(T) in the last of them.
  Matrix Positions(const Trajectory& run) const;
  /// Whether positions on the way cost anything.
  bool HasPathCost() const {
    return problem_.path_weight.size() > 0 && !problem_.path_weight.isZero(0);
  }

  const MechanicalSystem& system() const { return system_; }     ///< whose runs they are
  const TrajectoryProblem& problem() const { return problem_; }  ///< that they are of

 private:
  const MechanicalSystem& system_;
  const TrajectoryProblem& problem_;
  int inputs_ = 0, first_initial_ = 0, size_ = 0;
  Vector lower_, upper_;
};

}  // namespace contact_flow
