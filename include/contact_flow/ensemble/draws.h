// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/ensemble/philox.h"
#include "contact_flow/ensemble/sobol.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Some of the numbers in which the runs of an ensemble differ, and what they are in each run.
/// A name is that of
///   a coordinate, or "d/dt " and a velocity: its value;
///   an input (constant over the run) or a parameter: its value;
///   any of these, or of a velocity without a coordinate of its own (of a rotation), behind a "+":
///   what is added to the start, in its tangent chart (x0 ⊞ w), to the input, to the parameter.
struct DrawPart {
  /// How the numbers are chosen.
  enum class Kind {
    kGrid,     ///< every combination of `levels`, the last name's fastest
    kUniform,  ///< each in [low, high)
    kNormal,   ///< with `mean` and `covariance`
    kTable,    ///< row by row
  };
  Kind kind = Kind::kUniform;      ///< how they are chosen
  std::vector<std::string> names;  ///< [k]
  std::vector<Vector> levels;      ///< kGrid: [k] values of each name
  Vector low;                      ///< kUniform [k]
  Vector high;                     ///< kUniform [k]
  Vector mean;                     ///< kNormal [k]
  Matrix covariance;               ///< kNormal [k×k], positive semidefinite
  Matrix table;                    ///< kTable [rows×k]
};

/// What each run of an ensemble starts from. Grids and tables are gone through by the number of the
/// run, the last part fastest, and begin again after Sampler::period() runs; random numbers are
/// drawn part by part from Philox(seed, run), one each, or are the coordinates of a ShiftedSobol
/// point. So a run depends on its number and the seed alone.
struct Draws {
  std::uint64_t seed = 0;       ///< of the random numbers
  bool sobol = false;           ///< Sobol's sequence in place of random numbers
  std::vector<DrawPart> parts;  ///< names of all of them are different
};

/// Draws, ready to be drawn from.
class Sampler {
 public:
  /// Throws std::invalid_argument, naming part and name, for sizes, numbers that are not finite,
  /// low > high, a covariance that is not positive semidefinite, a name twice.
  explicit Sampler(const Draws& draws);

  /// All names, in the order of the parts.
  const std::vector<std::string>& names() const { return names_; }
  /// The numbers of run `run` [names]. Threads may share the sampler.
  void Draw(std::uint64_t run, Vector* values) const;
  /// After how many runs grids and tables begin again; 1 where there are none.
  std::uint64_t period() const { return period_; }
  /// Whether anything is random.
  bool IsRandom() const { return random_ > 0; }

 private:
  Draws draws_;
  std::vector<std::string> names_;
  std::vector<Matrix> roots_;  // of each part's covariance
  std::uint64_t period_ = 1;
  int random_ = 0;  // how many random numbers a run takes
  std::shared_ptr<const ShiftedSobol> sobol_;
};

/// What one run begins with.
struct RunStart {
  Vector x;                    ///< [nq+d]
  Vector u;                    ///< [m]
  ParameterValues parameters;  ///< only those that are drawn
};

/// Where drawn numbers go.
class StartMap {
 public:
  /// Over the start `x` and the input `u`. Throws std::invalid_argument with the nearest name for
  /// one that is neither of the state nor of inputs and parameters, or that needs a "+".
  StartMap(const MechanicalSystem& system, const std::vector<std::string>& names,
           const VectorRef& x, const VectorRef& u);

  /// The start of the run with these numbers. `start` is reused.
  void Apply(const VectorRef& values, RunStart* start) const;
  /// Whether an input is drawn by its value, not behind a "+".
  bool ReplacesInputs() const { return replaces_inputs_; }
  /// Whether parameters are drawn, so that runs need systems of their own.
  bool ChangesParameters() const { return changes_parameters_; }

 private:
  struct Place {
    enum class Kind { kState, kTangent, kInput, kParameter } kind;
    int index;
    bool added;
  };
  const MechanicalSystem& system_;
  std::vector<Place> places_;
  Vector x_, u_;
  bool changes_parameters_ = false, has_tangent_ = false, replaces_inputs_ = false;
};

/// Names of the state (q, v): coordinates, then "d/dt " and velocities [nq+d].
std::vector<std::string> EnsembleStateNames(const SystemDescription& description);
/// Names of tangents (δq, δv): velocities, then "d/dt " and velocities [2d].
std::vector<std::string> EnsembleTangentNames(const SystemDescription& description);

}  // namespace contact_flow
