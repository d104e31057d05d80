// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>

#include "contact_flow/derivative/measured_errors.h"
#include "contact_flow/flow/simulate.h"

namespace contact_flow {
namespace test {

/// Errors below these, relative to 1 + the largest entry, are rounding, as are their references'; a
/// step adds some to the state, of stages that are solved for.
constexpr double kStateRounding = 2e-14, kStepRounding = 5e-15, kDerivativeRounding = 1e-13;
/// A reference that changes by more than this part of the error, when made ten times looser, does
/// not tell it.
constexpr double kSure = 0.3;

/// How estimates lie beside true errors.
struct ErrorTally {
  int count = 0, below = 0, far = 0;
  void Add(double estimate, double error, double rounding) {
    ++count;
    estimate = std::max(estimate, rounding);
    error = std::max(error, rounding);
    below += estimate < error;
    far += estimate > 100 * error;
  }
};

inline double Largest(const Vector& x) { return x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0; }

/// A run whose errors are looked at.
struct CalibrationCase {
  const MechanicalSystem* system;
  Vector x;
  InputSchedule input;
  double duration = 1;
  SimulateOptions options;    // but for the tolerances
  SimulateOptions reference;  // … of the runs that tell the truth
  double unit = 1;            // absolute tolerances in those that are relative
  Variables variables;
  /// To numbers of order 1, a tangent [2d].
  std::function<Vector(const Vector&)> back = [](const Vector& tangent) { return tangent; };
};

/// True errors of runs at a tolerance, of their states and of their derivatives along random
/// directions: against the same run at a ten thousandth of the tolerance. Beside them what the
/// derivative states by itself and what a second run measures.
class Calibration {
 public:
  explicit Calibration(std::string name) : name_(std::move(name)) {}

  void Add(const CalibrationCase& c, double tolerance, unsigned seed) {
    try {
      const Run run(c, c.options, tolerance, std::min(1e-9, tolerance));
      const Run fine(c, c.reference, std::max(1e-13, 1e-4 * tolerance), 1e-13);
      const Run check(c, c.reference, std::max(1e-12, 1e-3 * tolerance), 1e-12);
      const bool same = run.trajectory.ModeSequence() == fine.trajectory.ModeSequence() &&
                        check.trajectory.ModeSequence() == fine.trajectory.ModeSequence();
      if (!same || !run.B.status.ok() || !fine.B.status.ok() || !check.B.status.ok()) {
        ++skipped_;
        return;
      }
      const MeasuredErrors measured(*c.system, c.x, c.input, c.duration, run.options,
                                    run.trajectory, run.B);
      const Vector end = fine.trajectory.FinalState();
      const auto apart = [&](const Run& other) {
        return Largest(c.back(c.system->Separation(other.trajectory.FinalState(), end)));
      };
      const double steps = static_cast<double>(run.trajectory.statistics.steps);
      const double rounding = (kStateRounding + kStepRounding * steps) *
                              (1 + Largest(c.back(c.system->Separation(end, c.x))));
      if (apart(check) <= std::max(kSure * apart(run), rounding)) {
        state_.Add(Largest(c.back(run.B.trust.state_error)), apart(run), rounding);
        measured_state_.Add(Largest(c.back(measured.OfState())), apart(run), rounding);
      }
      std::mt19937 random(seed);
      for (int k = 0; k < 2; ++k) AddDirection(c, run, fine, check, measured, &random);
    } catch (const std::logic_error&) {  // inadmissible states and directions
      ++skipped_;
    }
  }

  /// At most one of a hundred true errors, of `least`, is above what is estimated or measured.
  void ExpectEnough(int least) const {
    Print();
    ExpectAbove(state_, least / 2);
    ExpectAbove(derivative_, least);
    ExpectAbove(measured_state_, least / 2);
    ExpectAbove(measured_derivative_, least);
  }
  /// … and at most one of twenty a hundred times below what is measured.
  void Expect(int least) const {
    ExpectEnough(least);
    EXPECT_LE(measured_state_.far, measured_state_.count / 20) << name_;
    EXPECT_LE(measured_derivative_.far, measured_derivative_.count / 20) << name_;
  }

 private:
  void Print() const {
    Print("state", state_);
    Print("derivative", derivative_);
    Print("state, measured", measured_state_);
    Print("derivative, measured", measured_derivative_);
    std::printf("%s: %d skipped\n", name_.c_str(), skipped_);
  }
  void ExpectAbove(const ErrorTally& tally, int least) const {
    EXPECT_GE(tally.count, least) << name_;
    EXPECT_LE(tally.below, std::max(1, tally.count / 100)) << name_;
  }

  struct Run {
    Run(const CalibrationCase& c, const SimulateOptions& given, double tolerance, double tangents)
        : options(given) {
      options.relative_tolerance = tolerance;
      options.absolute_tolerance = c.unit * tolerance;
      trajectory = Simulate(*c.system, c.x, c.input, c.duration, options);
      BDerivativeOptions derivative;
      derivative.tolerance = tangents;
      derivative.variables = c.variables;
      B = DifferentiateOutcome(*c.system, trajectory, derivative);
    }
    SimulateOptions options;
    Trajectory trajectory;
    BDerivative B;
  };

  void AddDirection(const CalibrationCase& c, const Run& run, const Run& fine, const Run& check,
                    const MeasuredErrors& measured, std::mt19937* random) {
    std::normal_distribution<double> normal;
    const Eigen::Index d2 = 2 * c.system->dof(), size = run.B.arcs.front().cols();
    Vector w(size);
    for (double& entry : w) entry = normal(*random);
    // Parts of their values, where parameters have one.
    const auto& parameters = c.variables.parameters;
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      const double value = std::abs(c.system->description().parameters[parameters[j]].value);
      w(size - static_cast<Eigen::Index>(parameters.size() - j)) *= value;
    }
    w.head(d2) = PositionsAndRates(c, w.head(d2));
    w = ProjectAdmissible(*c.system, c.x, run.trajectory.arcs[0].mode, w, c.variables);
    const Vector exact = c.back(fine.B(w));
    const auto off = [&](const Run& other) { return Largest(c.back(other.B(w)) - exact); };
    const double error = off(run), rounding = kDerivativeRounding * (1 + Largest(exact));
    if (off(check) > std::max(kSure * error, rounding)) return;
    derivative_.Add(Largest(c.back(run.B.Error(w))), error, rounding);
    measured_derivative_.Add(Largest(c.back(measured.Along(w))), error, rounding);
  }

  /// A tangent whose numbers are of order 1 in the units of `back`.
  static Vector PositionsAndRates(const CalibrationCase& c, const Vector& w) {
    const Vector unit = c.back(Vector::Ones(w.size()));
    // `back` may permute, but lengths are one number and rates another.
    Vector scaled = w;
    const Eigen::Index d = w.size() / 2;
    scaled.head(d) /= unit(0);
    scaled.tail(d) /= unit(d);
    return scaled;
  }

  void Print(const char* what, const ErrorTally& tally) const {
    std::printf("%s, %s: %d errors, %d above the estimate, %d a hundred times below it\n",
                name_.c_str(), what, tally.count, tally.below, tally.far);
  }

  std::string name_;
  ErrorTally state_, derivative_, measured_state_, measured_derivative_;
  int skipped_ = 0;
};

}  // namespace test
}  // namespace contact_flow
