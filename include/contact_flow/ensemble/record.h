// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// A number of each run that is made of its final state and its input:
///   ½ Σ w_i (x_i(T) − target_i)² + ½ Σ r_j u_j².
struct CostTerm {
  std::string name;  ///< of the term
  Vector target;     ///< [nq+d]
  Vector weight;     ///< w ≥ 0 [nq+d]
  Vector effort;     ///< r ≥ 0 [m]
};

/// What is kept of each run.
struct Keep {
  bool outcome = true;      ///< how it came out, and its number of events
  bool start = false;       ///< the numbers that were drawn
  bool final_state = true;  ///< x(T), or where the run ended [nq+d]
  bool end_time = false;    ///< when it ended [s]
  bool words = false;       ///< contact modes passed through, see ModeWord
  bool margins = false;     ///< Margins, in the order of kMarginNames
  int events = 0;           ///< times of so many events from the first on, NaN behind the last [s]
  std::vector<double> samples;     ///< x at these instants, NaN behind the end of the run [s]
  std::vector<Vector> directions;  ///< B(w) of each, NaN where there is none [2d]
  bool jacobian = false;           ///< B row by row, NaN where it is not linear [2d×2d]
  std::vector<CostTerm> costs;     ///< also among the observables, behind the final state
  BDerivativeOptions derivative;   ///< of directions and Jacobian

  /// Whether runs need a derivative.
  bool Differentiates() const { return jacobian || !directions.empty(); }
};

/// Names of the columns of margins.
const std::vector<std::string>& MarginNames();

/// The contact modes of a run, "oo>lo>ll": one letter a contact, in the order of the constraints;
/// a bounce, from a mode into itself, counts. Longer than kMaxWord bytes it is cut, and ends in "~"
/// and a checksum of all of it.
std::string ModeWord(const std::vector<ContactMode>& modes, int num_constraints);
/// The same of the arcs of a run.
std::string ModeWord(const Trajectory& trajectory, int num_constraints);
inline constexpr std::size_t kMaxWord = 95;  ///< longest word [byte]

/// What is kept of the runs first, first + 1, …: a row each.
struct Columns {
  /// One thing of each run, `width` numbers.
  struct Real {
    std::string name;                ///< "final_state", "event_times", …
    std::vector<std::size_t> shape;  ///< of a row
    std::size_t width = 1;           ///< product of the shape
    std::vector<double> values;      ///< [rows × width]
  };
  std::uint64_t first = 0;               ///< the first run
  std::size_t rows = 0;                  ///< how many
  std::vector<std::int8_t> outcome;      ///< RunOutcome or Outcome [rows] or empty
  std::vector<std::int32_t> num_events;  ///< of transitions [rows] or empty
  /// Of the derivative, kNotDifferentiable where a direction has none [rows] or empty.
  std::vector<std::int8_t> derivative_outcome;
  std::vector<std::string> words;  ///< [rows] or empty
  std::vector<Real> reals;         ///< all else
};

/// What all that is kept of a run but samples and derivatives is made of.
struct RunEnd {
  Status status;                    ///< how it ended
  Vector x;                         ///< where [nq+d]
  double t = 0;                     ///< when [s]
  Vector u;                         ///< its first input [m]
  Margins margins;                  ///< as Trajectory
  std::string word;                 ///< ModeWord
  std::vector<double> event_times;  ///< of its transitions [s]
};

/// Fills columns, row by row. Rows may be filled by several threads at once.
class Recorder {
 public:
  /// Throws std::invalid_argument for sizes, and samples that are not in order or negative.
  Recorder(const MechanicalSystem& system, const Keep& keep, const std::vector<std::string>& drawn,
           double begin, double duration);

  /// Empty columns for these runs: NaN, and outcome kNotRun.
  Columns Make(std::uint64_t first, std::size_t rows) const;
  /// What one run is kept as takes [byte].
  double BytesPerRun() const;
  /// The start of a run.
  void WriteStart(const VectorRef& drawn, std::size_t row, Columns* columns) const;
  /// How it came out.
  void WriteOutcome(int outcome, std::size_t row, Columns* columns) const;
  /// Where and how it ended.
  void WriteEnd(const RunEnd& end, std::size_t row, Columns* columns) const;
  /// Its samples, and derivatives by `system`, the one of this run; these may throw
  /// BudgetExceeded where they take too long.
  void WriteMotion(const MechanicalSystem& system, const Trajectory& trajectory, std::size_t row,
                   Columns* columns) const;
  /// Rows [begin, end) as Make has them: nothing that was written to them counts.
  void Clear(std::size_t begin, std::size_t end, Columns* columns) const;
  /// Its costs [costs], with these inputs.
  Vector Costs(const VectorRef& x, const VectorRef& u) const;
  /// Whether runs need dense output.
  bool NeedsDense() const { return !keep_.samples.empty() || keep_.Differentiates(); }

 private:
  void WriteDerivative(const MechanicalSystem& system, const Trajectory& trajectory,
                       std::size_t row, Columns* columns) const;
  double* Row(const char* name, std::size_t row, Columns* columns) const;

  Keep keep_;
  std::vector<Columns::Real> layout_;
  double begin_;
};

}  // namespace contact_flow
