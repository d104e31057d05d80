// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/linear_inputs.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A number c of a run that is to lie in [lower, upper].
struct TrajectoryCondition {
  /// What c is.
  enum class Kind {
    kState,      ///< x_i at an instant of the grid, before an event there
    kTouchdown,  ///< when a constraint is met [s]
  };
  Kind kind = Kind::kState;  ///< what c is
  int index = 0;             ///< i into x [nq+d], or the constraint
  int number = 0;    ///< of the instant, 1 … K, which is the horizon; or of the touchdown, from 0
  double lower = 0;  ///< may be −∞
  double upper = 0;  ///< may be ∞; equal to lower: an equality

  /// "z at instant 3 of the grid", "d/dt z at the end" or "touchdown 1 of 'floor'".
  std::string Describe(const SystemDescription& names, std::size_t instants) const;
};

/// ∫ w (u_j v_i)² dt: what input j does to velocity i, its power where it is the force along it.
struct PowerTerm {
  int input = 0;      ///< j
  int velocity = 0;   ///< i, of d
  double weight = 0;  ///< w ≥ 0
};

/// A run that is to be chosen. With inputs u_k held on the K intervals of a grid, of lengths h_k,
///   J = Σ_k h_k Σ_j r_j (u_kj − ū_j)² + Σ_k h_k Σ_i s_i (q_i(t_{k+1}) − p_i)²
///       + Σ_i w_i (x_i(T) − g_i)² + w_T Σ_k h_k + Σ ∫ w (u_j v_i)² dt + Σ_events Σ_c w_c p_c²
///       + Σ_c ∫ w_c |T_c v|² dt while c touches,
/// x = (q, v) [nq+d]; no factor ½. Of the state positions alone cost at instants of the grid:
/// velocities jump, and their cost there would jump with the order of events.
///
/// Inputs may be led linearly instead, from u_k at t_k to u_{k+1} at t_{k+1}, u_K being that at T:
/// their effort is then ∫ Σ_j r_j (u_j − ū_j)² dt. At an instant of the grid they only turn, so
/// that an event there is no kink.
struct TrajectoryProblem {
  Vector x;                    ///< initial state [nq+d]
  InputSchedule inputs;        ///< grid [K], beginning at the start, and where to begin the search
  bool linear_inputs = false;  ///< they are led linearly, not held
  Vector input_end;     ///< … to this one at T, where the search begins [m]; empty: the last one
  double duration = 0;  ///< T > the last instant [s]

  bool choose_inputs = true;           ///< the unknowns u_k
  std::vector<int> choose_initial;     ///< and tangents (q, v) of the initial state, by index < 2d
  std::vector<int> choose_parameters;  ///< and parameters, by index into the description
  SystemFactory factory;  ///< makes the system of given parameters; needed where some are chosen
  std::vector<int> choose_durations;  ///< and h_k of these intervals: all later instants move, too
  /// The horizon stays: the last interval, which is then not among these, takes up their changes.
  bool keep_horizon = false;

  Vector effort;           ///< r ≥ 0 [m]
  Vector input_reference;  ///< ū [m]; empty: 0
  Matrix input_path;       ///< in its place a ū for each interval [m × K]; or empty
  Vector path_weight;      ///< s ≥ 0 [nq]; empty: none
  Vector path_target;      ///< p [nq]; empty: 0
  Matrix path_reference;   ///< in its place a p for each instant t_1 … t_K [nq × K]; or empty
  Vector weight;           ///< w ≥ 0 [nq+d]
  Vector target;           ///< g [nq+d]
  double duration_weight = 0;    ///< w_T ≥ 0 [1/s]
  std::vector<PowerTerm> power;  ///< on the way
  Vector impulse_weight;         ///< w_c ≥ 0 of impulses of each contact at events [n]; or empty
  /// w_c ≥ 0 of the slip of each contact with friction while it touches [n]; or empty
  Vector slip_weight;

  std::vector<TrajectoryCondition> conditions;  ///< that are to hold
  double condition_tolerance = 1e-8;            ///< by which they may be missed, in their own units

  Vector lower;            ///< of the inputs [m]; empty: none
  Vector upper;            ///< as lower
  Vector initial_lower;    ///< of changes of the initial state; empty: none
  Vector initial_upper;    ///< as initial_lower
  Vector parameter_lower;  ///< of the chosen parameters; empty: none
  Vector parameter_upper;  ///< as parameter_lower
  Vector duration_lower;   ///< of the chosen h_k, > 0 [s]; empty: a tenth of what they are
  /// As duration_lower [s]; empty: ten times, and not more than leaves a tenth of the last interval
  /// where the horizon is kept.
  Vector duration_upper;

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

/// The unknowns y = (u_1, …, u_K, δx, p, h) of a problem as one vector [n], and what they stand
/// for. `system` and `problem` must outlive it. Where inputs are led linearly there is one more,
/// and runs are those of LinearInputs: states, tangents and inputs below are its own.
class Unknowns {
 public:
  /// Throws std::invalid_argument, naming the field, for sizes, signs and indices that are not
  /// right, and for a choice of an initial state that is in contact or whose positions are no ℝᵈ.
  Unknowns(const MechanicalSystem& system, const TrajectoryProblem& problem);

  /// n.
  int size() const { return size_; }
  /// The place of u_kj, k ≤ K where inputs are led linearly, or −1.
  int Input(std::size_t k, int j) const {
    return problem_.choose_inputs ? static_cast<int>(k) * inputs_ + j : -1;
  }
  /// The place of the i-th of choose_initial.
  int Initial(std::size_t i) const { return first_initial_ + static_cast<int>(i); }
  /// The place of the i-th of choose_parameters.
  int Parameter(std::size_t i) const { return first_parameter_ + static_cast<int>(i); }
  /// The place of the i-th of choose_durations.
  int Duration(std::size_t i) const { return first_duration_ + static_cast<int>(i); }
  /// ∂h_k/∂y [1 × n], …
  const Eigen::RowVectorXd& LengthRow(std::size_t k) const { return length_rows_[k]; }
  /// … and ∂t_k/∂y, t_K being the horizon.
  const Eigen::RowVectorXd& InstantRow(std::size_t k) const { return instant_rows_[k]; }
  /// The derivative by y of the inputs that are held on interval k [· × n].
  Matrix InputRows(const Vector& y, std::size_t k) const;
  /// The changes of the inputs at y that the bounds of y allow, of each interval and beyond the
  /// horizon: an unknown on a bound goes inside.
  InputCones ConesOfInputs(const Vector& y) const;
  /// Values in the problem.
  Vector Start() const;
  /// Bounds of y, ±∞ where there are none [n].
  const Vector& lower() const { return lower_; }
  const Vector& upper() const { return upper_; }  ///< as lower
  /// The initial state at y [nq+d].
  Vector InitialState(const Vector& y) const;
  /// The inputs at y that are held, with their grid.
  InputSchedule Inputs(const Vector& y) const;
  /// u_k at y, of K inputs, or K + 1 that are led linearly [m].
  Vector InputAt(const Vector& y, std::size_t k) const;
  /// A state of a run as the problem has it [nq+d].
  Vector WithoutClock(const Vector& x) const;
  /// T at y [s].
  double Horizon(const Vector& y) const;
  /// h_k at y [s].
  double Length(const Vector& y, std::size_t k) const;
  /// t_1, …, t_K at y [s].
  std::vector<double> Instants(const Vector& y) const;
  /// The system with the parameters at y; throws what the factory throws.
  std::shared_ptr<const MechanicalSystem> SystemAt(const Vector& y) const;
  /// The run at y; `simultaneity_tolerance` in place of the problem's, `dense` for a run
  /// that is to be differentiated. `system` is SystemAt(y). Throws std::invalid_argument for starts
  /// and durations that are none.
  Trajectory Run(const MechanicalSystem& system, const Vector& y, double simultaneity_tolerance,
                 bool dense) const;
  /// The same run, of which T is one more instant of the grid, for `beyond` > 0 longer [s].
  Trajectory RunBeyond(const MechanicalSystem& system, const Vector& y,
                       double simultaneity_tolerance, bool dense, double beyond) const;
  /// Run of its own SystemAt(y).
  Trajectory Run(const Vector& y, double simultaneity_tolerance, bool dense) const;
  /// J of a run without power, impulses and slip, by its States.
  double Cost(const Vector& y, const Matrix& states) const;
  /// J of a run with its motion, if there is a cost of power or slip, else of any run.
  double Cost(const Vector& y, const Trajectory& run) const;
  /// x at t_1, …, t_K, left limits, of a Run or a RunBeyond [nq+d × K].
  Matrix States(const Trajectory& run) const;
  /// ū of interval k [m].
  Vector InputReference(std::size_t k) const;
  /// p at t_{k+1} [nq].
  Vector PathTarget(std::size_t k) const;
  /// Whether slip costs anything.
  bool HasSlipCost() const {
    return problem_.slip_weight.size() > 0 && !problem_.slip_weight.isZero(0);
  }
  /// Whether there are costs by name that are integrals.
  bool HasRunningCost() const { return !problem_.power.empty() || HasSlipCost(); }
  /// Whether positions on the way cost anything.
  bool HasPathCost() const {
    return problem_.path_weight.size() > 0 && !problem_.path_weight.isZero(0);
  }

  const MechanicalSystem& system() const { return system_; }     ///< whose runs they are
  const TrajectoryProblem& problem() const { return problem_; }  ///< that they are of
  /// The number of inputs that are chosen [m].
  int num_inputs() const { return inputs_; }

 private:
  /// A problem with inputs that are led linearly as one of LinearInputs.
  struct Led;
  static std::shared_ptr<const Led> Lead(const MechanicalSystem& system,
                                         const TrajectoryProblem& problem);
  const Vector& FirstInput(std::size_t k) const;
  void CheckSizes() const;
  void CheckConditions() const;
  void CheckNamedCosts() const;
  void CheckSlip() const;
  void PlaceDurations();
  void SetBounds();

  const MechanicalSystem& given_;
  std::shared_ptr<const Led> led_;  // null where inputs are held
  const MechanicalSystem& system_;
  const TrajectoryProblem& problem_;
  int inputs_ = 0, first_initial_ = 0, first_parameter_ = 0, first_duration_ = 0, size_ = 0;
  Vector lower_, upper_;
  std::vector<Eigen::RowVectorXd> length_rows_, instant_rows_;
};

}  // namespace contact_flow
