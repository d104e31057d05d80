// SPDX-License-Identifier: BSD-3-Clause
// What a sweep gives does not depend on who had run which part of it, and with how many lanes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "contact_flow/budget.h"
#include "contact_flow/ensemble/sweep.h"
#include "test/ensemble/requests.h"

namespace contact_flow {
namespace {

constexpr std::uint64_t kBlock = Tally::kBlock;

std::string Bits(const Columns& c) {
  ByteWriter out;
  out.Put(c.outcome);
  out.Put(c.num_events);
  out.Put(c.derivative_outcome);
  for (const std::string& word : c.words) out.Put(word);
  for (const Columns::Real& column : c.reals) out.Put(column.values);
  return out.bytes();
}

/// Runs that come out in several ways: those that start below the ground, and those that take more
/// than some steps.
SweepRequest Mixed(std::uint64_t count) {
  SweepRequest request = Nominal("soft_biped", count);
  request.draws.seed = 7;
  request.draws.parts = {Uniform({"body_pitch", "d/dt body_pitch", "left_foot_z"},
                                 Eigen::Vector3d(-0.3, -2, -0.05), Eigen::Vector3d(0.3, 2, 0.6))};
  request.options.max_steps = 60;
  request.keep.words = true;
  request.keep.costs = {{"pitch", Vector::Zero(14), Vector::Unit(14, 6), Vector()}};
  request.histograms = {{6, -1, 1, 20}, {14, 0, 0.1, 7}};
  return request;
}

TEST(Partition, AnyChunksThreadsAndOrderHaveTheSameBits) {
  constexpr std::uint64_t kRuns = 12 * kBlock + 100;
  SweepRequest request = Mixed(kRuns);
  request.threads = 1;
  request.lanes = LaneSet::kNone;
  const SweepResult whole = Sweep(request);
  const Summary total = whole.tally.Total();
  EXPECT_EQ(3u, total.outcomes.size());  // ok, inadmissible, budget exceeded
  std::mt19937 generator(3);
  for (int trial = 0; trial < 6; ++trial) {
    std::vector<std::uint64_t> edges = {0, kRuns};
    for (int k = 0; k < trial; ++k) edges.push_back(generator() % 13 * kBlock);
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    std::vector<std::size_t> order(edges.size() - 1);
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::shuffle(order.begin(), order.end(), generator);
    Tally left, right;  // of two machines
    std::vector<SweepResult> parts(order.size());
    for (std::size_t k : order) {
      request.first = edges[k];
      request.count = edges[k + 1] - edges[k];
      request.threads = 1 + static_cast<int>(generator() % 4);
      request.lanes = generator() % 2 == 0 ? LaneSet::kNone : LaneSet::kBest;
      parts[k] = Sweep(request);
      (generator() % 2 == 0 ? left : right).Merge(parts[k].tally);
    }
    left.Merge(Tally::FromBytes(right.ToBytes()));
    EXPECT_EQ(whole.tally.ToBytes(), left.ToBytes()) << trial;
    std::size_t row = 0;
    for (const SweepResult& part : parts) {
      for (std::size_t k = 0; k < part.columns.rows; ++k, ++row) {
        ASSERT_EQ(whole.columns.outcome[row], part.columns.outcome[k]) << row;
        ASSERT_EQ(whole.columns.words[row], part.columns.words[k]) << row;
        const double* a = whole.columns.reals[0].values.data() + 14 * row;
        const double* b = part.columns.reals[0].values.data() + 14 * k;
        ASSERT_EQ(0, std::memcmp(a, b, 14 * sizeof(double))) << row;
      }
    }
    EXPECT_EQ(kRuns, row);
  }
}

TEST(Partition, LanesHaveTheBitsOfSingleRuns) {
  struct Case {
    const char* model;
    DrawPart draw;
  };
  const Vector one = Vector::Ones(1);
  const Case cases[] = {
      {"soft_biped", Uniform({"+body_pitch", "+d/dt body_pitch"}, Eigen::Vector2d(-0.3, -2),
                             Eigen::Vector2d(0.3, 2))},
      {"hopping_trot",
       Uniform({"body_pitch", "d/dt body_pitch"}, Eigen::Vector2d(-1, -8), Eigen::Vector2d(1, 8))},
      {"steered_trot", Uniform({"+body_pitch", "pitch_torque"}, Eigen::Vector2d(-0.2, -0.1),
                               Eigen::Vector2d(0.2, 0.1))},
      {"driven_ball", Uniform({"z", "+d/dt z"}, Eigen::Vector2d(-0.1, -1), Eigen::Vector2d(2, 1))},
      {"wall_and_floor", Uniform({"+d/dt x"}, -one, one)}};
  int lanes = 0;
  for (const Case& c : cases) {
    SweepRequest request = Nominal(c.model, 2 * kBlock + 77);
    request.draws.parts = {c.draw};
    request.keep.words = request.keep.margins = request.keep.end_time = request.keep.start = true;
    request.keep.events = 4;
    request.lanes = LaneSet::kNone;
    try {
      const SweepResult alone = Sweep(request);
      EXPECT_GT(alone.tally.Total().measured, kBlock / 2) << c.model;
      for (LaneSet set : {LaneSet::kBest, LaneSet::kAvx2, LaneSet::kAvx512}) {
        request.lanes = set;
        const SweepResult swept = Sweep(request);
        EXPECT_EQ(alone.tally.ToBytes(), swept.tally.ToBytes()) << c.model;
        EXPECT_EQ(Bits(alone.columns), Bits(swept.columns)) << c.model;
        ++lanes;
      }
    } catch (const std::invalid_argument& error) {
      ADD_FAILURE() << c.model << ": " << error.what();
    }
  }
  EXPECT_EQ(15, lanes);
}

TEST(Partition, AGridOfInputsHasTheBitsOfAll) {
  // Several inputs, samples or derivatives are none of the lanes': the first two blocks once with
  // and once without what keeps them out.
  SweepRequest request = Nominal("soft_biped", 2 * kBlock);
  request.draws.parts = {
      Uniform({"body_pitch"}, Vector::Constant(1, -0.3), Vector::Constant(1, 0.3))};
  const SweepResult lanes = Sweep(request);
  request.keep.samples = {0.5};
  EXPECT_EQ(lanes.tally.ToBytes(), Sweep(request).tally.ToBytes());
}

TEST(Partition, RunsBeyondTheirNumberIn32BitsAreTheirOwn) {
  SweepRequest request = Mixed(kBlock);
  request.keep.start = true;
  for (std::uint64_t first : {std::uint64_t{1} << 32, (std::uint64_t{5} << 40) + kBlock}) {
    for (bool sobol : {false, true}) {
      request.first = first;
      request.draws.sobol = sobol;
      const SweepResult result = Sweep(request);
      const Sampler sampler(request.draws);
      const ShiftedSobol points(3, request.draws.seed);
      for (std::uint64_t k : {0, 255}) {
        Philox random(request.draws.seed, first + k);
        for (int d = 0; d < 3; ++d) {
          const double u =
              sobol ? Philox::UnitInterval(points.Bits(first + k, d)) : random.Uniform();
          const DrawPart& part = request.draws.parts[0];
          EXPECT_EQ(part.low(d) + (part.high(d) - part.low(d)) * u,
                    result.columns.reals[0].values[3 * k + static_cast<std::size_t>(d)]);
        }
      }
      Tally tally = Tally::FromBytes(result.tally.ToBytes());
      EXPECT_THROW(tally.Add(first / kBlock, Summary(15, request.histograms)),
                   std::invalid_argument);  // it is there, by its own number
    }
  }
}

TEST(Partition, WhatWasEndedLeavesNoNumbers) {
  for (LaneSet set : {LaneSet::kNone, LaneSet::kBest}) {
    SweepRequest request = Mixed(400000);
    request.lanes = set;
    request.keep.outcome = request.keep.words = false;
    request.keep.costs.clear();
    request.histograms.clear();
    const Budget budget;
    request.progress_every = 0.1;
    request.progress = [&](const SweepProgress& p) {
      if (p.done > 0) budget.Cancel("enough");
    };
    SweepResult result;
    {
      const BudgetScope scope(budget);
      result = Sweep(request);
    }
    ASSERT_EQ(Outcome::kCancelled, result.status.outcome);
    const Summary total = result.tally.Total();
    std::uint64_t rows = 0;
    for (std::size_t row = 0; row < 400000; ++row) {
      rows += !std::isnan(result.columns.reals[0].values[14 * row]);
    }
    // Of the counted ones all have a state but the inadmissible, and no others have.
    EXPECT_EQ(total.runs - total.outcomes.at(kInadmissible), rows);
    EXPECT_LT(total.runs, 400000u);
    EXPECT_GT(total.runs, 0u);
  }
}

TEST(Partition, ObservablesThatAreNotFiniteAreCountedAsThat) {
  SweepRequest request = Nominal("soft_biped", kBlock);
  request.draws.parts = {Uniform({"body_x"}, Vector::Constant(1, -1), Vector::Constant(1, 1))};
  // ½ 1e308 (x − t)² overflows where |x − t| > 1.9: for a part of the starts.
  request.keep.costs = {{"far", Vector::Constant(14, 1.4), 1e308 * Vector::Unit(14, 0), Vector()}};
  for (bool dense : {false, true}) {
    if (dense) request.keep.samples = {0.1};
    const SweepResult result = Sweep(request);
    const Summary total = result.tally.Total();
    const std::uint64_t lost = total.outcomes.at(static_cast<int>(Outcome::kNonFinite));
    EXPECT_GT(lost, 10u);
    EXPECT_EQ(kBlock - lost, total.measured);
    EXPECT_TRUE(total.mean.allFinite());
    EXPECT_NE(std::string::npos,
              total.examples.at(static_cast<int>(Outcome::kNonFinite)).second.find("'far'"));
    EXPECT_EQ(static_cast<std::ptrdiff_t>(lost),
              std::count(result.columns.outcome.begin(), result.columns.outcome.end(),
                         static_cast<std::int8_t>(Outcome::kNonFinite)));
  }
}

}  // namespace
}  // namespace contact_flow
