// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

/// What may be asked of runs and of sessions, as a front end fills it in: plain values that nobody
/// has checked yet. What is left out is the default. Who reads them names their fields in messages
/// as front ends call them ("state.q", "direction_matrix.data", "options.max_step").
namespace contact_flow {

/// The state x = (q, v) to begin with, or changes of one.
struct AskedState {
  std::vector<double> q;  ///< all coordinates [nq], [m] or [rad], or none
  std::vector<double> v;  ///< all velocities [d], [m/s] or [rad/s], or none
  /// On top of these, single ones [k]: coordinates, or velocities where only these are set.
  std::vector<std::string> names;
  std::vector<double> positions;   ///< [k] or none
  std::vector<double> velocities;  ///< [k] or none
  bool project = false;  ///< onto unit quaternions and bilateral constraints, by the shortest step
};

/// An input that is constant on each interval of a grid.
struct AskedGrid {
  std::vector<double> times;   ///< [K], the first 0, increasing [s]; none: one interval
  std::vector<double> values;  ///< [K×m] row by row; none: the constant input on each interval
};

/// What to change of SimulateOptions: 0, "" and false leave the default.
struct AskedOptions {
  double relative_tolerance = 0;
  double absolute_tolerance = 0;
  double max_step = 0;                ///< [s]
  double simultaneity_tolerance = 0;  ///< [s]
  double gap_tolerance = 0;           ///< [m]
  double speed_tolerance = 0;         ///< [m/s]
  double zeno_interval = 0;
  bool complete_zeno = false;
  std::int64_t max_steps = 0;
  std::int64_t max_events = 0;
  double max_seconds = 0;    ///< [s]
  double max_megabytes = 0;  ///< [10⁶ byte]
  std::string impact_law;    ///< one of ImpactLawNames()
  std::string method;        ///< one of IntegrationMethodNames()
};

/// What to change of BDerivativeOptions: 0 leaves the default.
struct AskedDerivativeOptions {
  double tolerance = 0;
  double kink_tolerance = 0;
  std::int32_t max_activations_for_pieces = 0;
  std::uint64_t max_pieces = 0;
};

/// A run from time 0 on.
struct AskedRun {
  double duration = 0;        ///< [s]; 0: the nominal one
  AskedState state;           ///< changes of the nominal state
  std::vector<double> input;  ///< [m], or none for the nominal one
  AskedGrid grid;
  AskedOptions options;
};

/// Directions in which a state, inputs and parameters are perturbed. Without any, both signs of
/// everything are meant.
struct AskedDirections {
  /// "+left_foot_z", "-d/dt body_pitch", "+input thrust", "-parameter stiffness".
  std::vector<std::string> names;
  /// More of them, one a row (δq, δv, δu, δp) of 2d+k; rows and cols may be left 0.
  struct Rows {
    std::uint32_t rows = 0;
    std::uint32_t cols = 0;
    std::vector<double> data;  ///< [rows × cols], row by row
  };
  Rows matrix;
  /// Those that the contact mode does not admit are projected, instead of refused.
  bool project = false;
};

/// A mark, or that it be removed.
struct AskedMark {
  std::uint32_t epoch = 0;  ///< filled in by the session
  double t = 0;             ///< likewise, the present [s]
  AskedDirections directions;
  bool by_inputs = false;                  ///< directions have parts along all inputs
  std::vector<std::string> by_parameters;  ///< and along these parameters
  bool clear = false;                      ///< remove the mark, and nothing else
};

/// Where the motion will be, and its perturbations.
struct AskedPrediction {
  std::uint32_t epoch = 0;  ///< filled in by the session
  std::uint64_t index = 0;  ///< likewise: 1, 2, …
  double t = 0;             ///< likewise, the present [s]
  double horizon = 0;       ///< from the present on [s]
  AskedDirections directions;
  double size = 0;  ///< of the perturbations; 0: 0.01
};

}  // namespace contact_flow
