// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/sweep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/piecewise_linear/covariance.h"
#include "test/ensemble/requests.h"

namespace contact_flow {
namespace {

const Columns::Real& Find(const Columns& columns, const std::string& name) {
  for (const Columns::Real& column : columns.reals) {
    if (column.name == name) return column;
  }
  throw std::out_of_range(name);
}

bool SameBits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), 8 * a.size()) == 0;
}

/// Pitch and its rate of the soft biped's landing.
SweepRequest Landing(std::uint64_t count) {
  SweepRequest request = Nominal("soft_biped", count);
  request.draws.seed = 1;
  request.draws.parts = {Uniform({"body_pitch", "d/dt body_pitch"}, Eigen::Vector2d(-0.3, -0.5),
                                 Eigen::Vector2d(0.3, 0.5))};
  return request;
}

TEST(Sweep, RunsAreThoseOfSimulate) {
  SweepRequest request = Landing(300);
  request.keep.start = request.keep.words = request.keep.margins = request.keep.end_time = true;
  request.keep.events = 3;
  request.keep.samples = {0, 0.5, 1.2};
  request.keep.directions = {Vector::Unit(14, 6)};
  request.keep.jacobian = true;
  request.keep.costs = {{"height", Vector::Zero(14), Vector::Unit(14, 1), Vector()}};
  const SweepResult result = Sweep(request);
  ASSERT_TRUE(result.status.ok());
  ASSERT_EQ(300u, result.columns.rows);
  const Columns& c = result.columns;
  for (std::size_t row = 0; row < 300; row += 23) {
    const double* z = Find(c, "start").values.data() + 2 * row;
    Vector x = request.x;
    x(6) = z[0];
    x(13) = z[1];
    const Trajectory run = Simulate(*request.system, x, request.inputs.values[0], request.duration);
    ASSERT_EQ(static_cast<int>(run.status.outcome), c.outcome[row]);
    EXPECT_EQ(run.transitions.size(), static_cast<std::size_t>(c.num_events[row]));
    EXPECT_EQ(ModeWord(run, 2), c.words[row]);
    EXPECT_EQ(0, std::memcmp(run.FinalState().data(),
                             Find(c, "final_state").values.data() + 14 * row, 8 * 14));
    EXPECT_EQ(run.t_end(), Find(c, "end_time").values[row]);
    const double* times = Find(c, "event_times").values.data() + 3 * row;
    for (std::size_t k = 0; k < 3; ++k) {
      if (k < run.transitions.size()) {
        EXPECT_EQ(run.transitions[k].t, times[k]);
      } else {
        EXPECT_TRUE(std::isnan(times[k]));
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector wanted = run.State(request.keep.samples[k]);
      EXPECT_EQ(0, std::memcmp(wanted.data(), Find(c, "samples").values.data() + 14 * (3 * row + k),
                               8 * 14));
    }
    EXPECT_EQ(0.5 * run.FinalState()(1) * run.FinalState()(1), Find(c, "costs").values[row]);
    EXPECT_EQ(run.margins.approach_speed, Find(c, "margins").values[6 * row]);
    const BDerivative B = DifferentiateOutcome(*request.system, run);
    ASSERT_TRUE(B.status.ok());
    EXPECT_EQ(0, c.derivative_outcome[row]);
    const Vector slope = B(Vector(Vector::Unit(14, 6)));
    for (std::size_t i = 0; i < 14; ++i) {
      EXPECT_EQ(slope(static_cast<Eigen::Index>(i)), Find(c, "derivative").values[14 * row + i]);
      EXPECT_EQ(slope(static_cast<Eigen::Index>(i)),
                Find(c, "jacobian").values[196 * row + 14 * i + 6]);
    }
  }
}

TEST(Sweep, HasTheSameBitsForAnyThreadsAndChunks) {
  SweepRequest request = Landing(3000);
  request.keep.words = true;
  request.histograms = {{6, -1, 1, 20}};
  request.threads = 1;
  const SweepResult one = Sweep(request);
  EXPECT_EQ(3000u, one.progress.done);
  request.threads = 5;
  const SweepResult many = Sweep(request);
  EXPECT_EQ(one.tally.ToBytes(), many.tally.ToBytes());
  EXPECT_TRUE(
      SameBits(Find(one.columns, "final_state").values, Find(many.columns, "final_state").values));
  EXPECT_EQ(one.columns.words, many.columns.words);
  Tally merged;
  std::vector<double> states;
  std::vector<SweepResult> chunks;
  for (std::uint64_t first : {2304, 0, 512}) {
    request.first = first;
    request.count = first == 0 ? 512 : first == 512 ? 1792 : 696;
    chunks.push_back(Sweep(request));
    merged.Merge(chunks.back().tally);
  }
  EXPECT_EQ(one.tally.ToBytes(), merged.ToBytes());
  for (std::size_t k : {1, 2, 0}) {
    const auto& part = Find(chunks[k].columns, "final_state").values;
    states.insert(states.end(), part.begin(), part.end());
  }
  EXPECT_TRUE(SameBits(Find(one.columns, "final_state").values, states));
}

TEST(Sweep, DrawsParameters) {
  SweepRequest request = Nominal("soft_biped", 256);
  DrawPart grid;
  grid.kind = DrawPart::Kind::kGrid;
  grid.names = {"stiffness"};
  grid.levels = {Eigen::Vector4d(25, 27, -1, 30)};  // −1 is refused by the model
  request.draws.parts = {grid};
  const SweepResult result = Sweep(request);
  const Summary total = result.tally.Total();
  EXPECT_EQ(64u, total.outcomes.at(kInadmissible));
  EXPECT_EQ(192u, total.outcomes.at(0));
  EXPECT_NE(std::string::npos, total.examples.at(kInadmissible).second.find("stiffness"));
  EXPECT_EQ(2u, total.examples.at(kInadmissible).first);
  const auto system = MakeModel("soft_biped", {{"stiffness", 30}});
  const Trajectory run = Simulate(*system, request.x, request.inputs.values[0], request.duration);
  EXPECT_EQ(0, std::memcmp(run.FinalState().data(),
                           Find(result.columns, "final_state").values.data() + 14 * 3, 8 * 14));
  EXPECT_EQ(kInadmissible, result.columns.outcome[2]);
  EXPECT_TRUE(std::isnan(Find(result.columns, "final_state").values[14 * 2]));
}

TEST(Sweep, InadmissibleStartsAndBudgetsAreOutcomes) {
  SweepRequest request = Nominal("bouncing_ball", 512);
  request.duration = 0.2;  // before its bounces accumulate
  DrawPart height = Uniform({"z"}, Vector::Constant(1, -1), Vector::Constant(1, 1));
  request.draws.parts = {height};
  SweepResult result = Sweep(request);
  const double share = static_cast<double>(result.tally.Total().outcomes.at(kInadmissible)) / 512;
  EXPECT_NEAR(0.5, share, 5 * 0.5 / std::sqrt(512));
  request.options.max_steps = 1;  // every run takes more
  request.draws.parts[0].low(0) = 0.1;
  result = Sweep(request);
  EXPECT_EQ(512u, result.tally.Total().outcomes.at(static_cast<int>(Outcome::kBudgetExceeded)));
}

TEST(Sweep, WhatThrowsIsAnOutcome) {
  SweepRequest request = Landing(512);
  request.draws.parts.push_back(Uniform({"stiffness"}, Vector::Ones(1), Vector::Constant(1, 2)));
  int calls = 0;
  request.threads = 1;
  request.make = [&calls](const ParameterValues& values) -> std::unique_ptr<MechanicalSystem> {
    if (++calls % 2 == 0) throw std::runtime_error("out of order");
    return MakeModel("soft_biped", values);
  };
  const Summary total = Sweep(request).tally.Total();
  EXPECT_EQ(256u, total.outcomes.at(kThrew));
  EXPECT_EQ("out of order", total.examples.at(kThrew).second);
  EXPECT_EQ(512u, total.runs);
}

TEST(Sweep, CancelsWithinABudget) {
  SweepRequest request = Landing(2000000);
  request.keep.final_state = false;
  BudgetLimits limits;
  limits.max_seconds = 0.3;
  const Budget budget(limits);
  SweepResult result;
  {
    const BudgetScope scope(budget);
    result = Sweep(request);
  }
  EXPECT_EQ(Outcome::kBudgetExceeded, result.status.outcome);
  EXPECT_LT(budget.elapsed(), 10);  // on a busy machine
  std::uint64_t run = 0;
  for (std::int8_t outcome : result.columns.outcome) run += outcome != kNotRun;
  EXPECT_EQ(run, result.tally.Total().runs);
  EXPECT_EQ(run, result.progress.done);
  EXPECT_LT(run, request.count);
}

TEST(Sweep, ReportsProgressAndWhatTheCallbackThrows) {
  SweepRequest request = Landing(2000);
  request.progress_every = 0;
  std::uint64_t last = 0;
  int reports = 0;
  request.progress = [&](const SweepProgress& p) {
    EXPECT_GE(p.done, last);
    EXPECT_EQ(2000u, p.total);
    last = p.done;
    ++reports;
  };
  Sweep(request);
  EXPECT_EQ(2000u, last);
  EXPECT_GE(reports, 1);
  request.progress = [](const SweepProgress&) { throw std::runtime_error("enough"); };
  EXPECT_THROW(Sweep(request), std::runtime_error);
}

TEST(Sweep, RefusesBeforeItStarts) {
  SweepRequest request = Landing(1000);
  request.first = 100;
  EXPECT_THROW(Sweep(request), std::invalid_argument);
  request = Landing(1000);
  request.max_megabytes = 0.01;
  EXPECT_THROW(Sweep(request), BudgetExceeded);
  request = Landing(1000);
  for (const char* name : {"", "body_pitch", "d/dt body_z"}) {  // asked for by their names
    request.keep.costs = {{name, Vector::Zero(14), Vector::Zero(14), Vector()}};
    EXPECT_THROW(Sweep(request), std::invalid_argument) << name;
  }
  request.keep.costs.assign(2, {"cost", Vector::Zero(14), Vector::Zero(14), Vector()});
  EXPECT_THROW(Sweep(request), std::invalid_argument);
  request = Landing(1000);
  request.histograms.assign(1000, {6, -1, 1, 1000000});  // of 8 GB
  EXPECT_THROW(Sweep(request), BudgetExceeded);
  request = Landing(1000);
  request.keep.samples = {0.5, 0.4};
  EXPECT_THROW(Sweep(request), std::invalid_argument);
  request = Landing(1000);
  request.inputs.grid = {0, 1};
  EXPECT_THROW(Sweep(request), std::invalid_argument);
  request = Landing(1000);
  request.duration = -1;
  EXPECT_THROW(Sweep(request), std::invalid_argument);
}

TEST(Sweep, AddsInputsOnAGrid) {
  SweepRequest request = Nominal("double_pendulum", 256);
  const std::string name = request.system->description().inputs.at(0);
  const Vector u = Vector::Zero(request.system->num_inputs());
  Vector more = u;
  more(0) = 0.1;
  request.inputs = {{0, 0.2}, {u, more}};
  const Vector quarter = Vector::Constant(1, 0.25);
  request.draws.parts = {Uniform({"+" + name}, quarter, quarter)};
  const SweepResult result = Sweep(request);
  Vector first = u, second = u;
  first(0) = 0.25;
  second(0) = 0.1 + 0.25;
  const Trajectory run = Simulate(*request.system, request.x,
                                  InputSchedule{{0, 0.2}, {first, second}}, request.duration);
  const Vector& x = run.FinalState();
  EXPECT_EQ(0, std::memcmp(x.data(), Find(result.columns, "final_state").values.data(),
                           8 * static_cast<std::size_t>(x.size())));
  request.draws.parts[0].names = {name};
  EXPECT_THROW(Sweep(request), std::invalid_argument);
}

TEST(Sweep, MomentsThroughSimultaneousTouchdownAreThoseOfTheDerivative) {
  // n = 20 000 runs of the soft biped that lands on both feet, pitch and pitch rate spread by
  // σ = 1e-3: two linear pieces. Means within 4 σ_y/√n; variances within 4 √(κ/n) of themselves,
  // κ = 3 of a normal being 2, of the folded ones below 3; and σ² of the second order.
  const double sigma = 1e-3;
  const int n = 20000;
  SweepRequest request = Nominal("soft_biped", n);
  DrawPart part;
  part.kind = DrawPart::Kind::kNormal;
  part.names = {"body_pitch", "d/dt body_pitch"};
  part.mean = Vector::Zero(2);
  part.covariance = sigma * sigma * Matrix::Identity(2, 2);
  request.draws.parts = {part};
  request.keep.final_state = request.keep.outcome = false;
  const SweepResult swept = Sweep(request);
  EXPECT_TRUE(swept.columns.outcome.empty());
  const Summary total = swept.tally.Total();
  ASSERT_EQ(static_cast<std::uint64_t>(n), total.measured);
  const Trajectory run =
      Simulate(*request.system, request.x, request.inputs.values[0], request.duration);
  Matrix P = Matrix::Zero(14, 14);
  P(6, 6) = P(13, 13) = sigma * sigma;
  const OutcomeCovariance predicted =
      PropagateCovariance(DifferentiateOutcome(*request.system, run).Pieces(), P);
  const Matrix covariance = total.Covariance();
  double kink = 0;
  for (int i = 0; i < 14; ++i) {
    const double variance = predicted.covariance(i, i);
    const double second = 100 * sigma * sigma;  // curvature of the outcome
    EXPECT_NEAR(predicted.mean(i), total.mean(i),
                4 * std::sqrt(variance / n) + predicted.mean_error + second);
    EXPECT_NEAR(variance, covariance(i, i),
                4 * variance * std::sqrt(3.0 / n) + predicted.covariance_error +
                    second * std::sqrt(variance) + second * second);
    if (variance > 0) kink = std::max(kink, std::abs(predicted.mean(i)) / std::sqrt(variance / n));
  }
  EXPECT_GT(kink, 10);                // the mean that the kink makes is seen
  EXPECT_EQ(2u, total.words.size());  // left foot first, right foot first
}

}  // namespace
}  // namespace contact_flow
