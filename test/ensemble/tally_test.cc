// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/tally.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>
#include <vector>

#include "contact_flow/ensemble/philox.h"

namespace contact_flow {
namespace {

/// y of a run, correlated, far from zero: 1e6 and spreads of 1.
Vector Observed(std::uint64_t run) {
  Philox random(4, run);
  const double a = random.Normal(), b = random.Normal();
  return Eigen::Vector3d(1e6 + a, a + b, std::exp(b));
}

Summary Block(std::uint64_t block, std::uint64_t runs) {
  Summary summary(3, {{1, -2, 2, 8}});
  for (std::uint64_t run = block * Tally::kBlock; run < std::min(runs, (block + 1) * Tally::kBlock);
       ++run) {
    if (run % 10 == 3) {
      summary.AddUnmeasured(run, kInadmissible, "", "run " + std::to_string(run));
    } else {
      summary.AddMeasured(Observed(run), run % 2 == 0 ? "o>l" : "o");
    }
  }
  return summary;
}

constexpr std::uint64_t kRuns = 100 * Tally::kBlock - 100, kBlocks = 100;

Tally InOrder() {
  Tally tally;
  for (std::uint64_t block = 0; block < kBlocks; ++block) tally.Add(block, Block(block, kRuns));
  return tally;
}

TEST(Tally, HasTheMomentsOfTwoPasses) {
  const Summary total = InOrder().Total();
  std::vector<Vector> all;
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    if (run % 10 != 3) all.push_back(Observed(run));
  }
  const auto n = static_cast<double>(all.size());
  ASSERT_EQ(all.size(), total.measured);
  EXPECT_EQ(kRuns, total.runs);
  Vector mean = Vector::Zero(3);
  for (const Vector& y : all) mean += (y - all[0]) / n;
  mean += all[0];
  Matrix covariance = Matrix::Zero(3, 3);
  for (const Vector& y : all) covariance += (y - mean) * (y - mean).transpose() / (n - 1);
  // Rounding: y has 1e-10 beside 1e6, of which some 1e4 random ones average.
  EXPECT_LE((mean - total.mean).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LE((covariance - total.Covariance()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Tally, CountsWhatThereIs) {
  const Summary total = InOrder().Total();
  std::uint64_t inadmissible = 0, even = 0;
  std::vector<std::uint64_t> bins(10, 0);
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    if (run % 10 == 3) {
      ++inadmissible;
      continue;
    }
    even += run % 2 == 0;
    const double y = Observed(run)(1);
    ++bins[y < -2 ? 0 : y >= 2 ? 9 : 1 + static_cast<std::size_t>(std::floor((y + 2) * 2))];
  }
  EXPECT_EQ(inadmissible, total.outcomes.at(kInadmissible));
  EXPECT_EQ(kRuns - inadmissible, total.outcomes.at(0));
  EXPECT_EQ(even, total.words.at("o>l"));
  EXPECT_EQ(bins, total.histograms[0]);
  EXPECT_EQ(3u, total.examples.at(kInadmissible).first);
  EXPECT_EQ("run 3", total.examples.at(kInadmissible).second);
}

TEST(Tally, HasTheSameBitsInAnyOrder) {
  const std::string wanted = InOrder().ToBytes();
  std::mt19937 generator(1);
  std::vector<std::uint64_t> order(kBlocks);
  std::iota(order.begin(), order.end(), 0);
  for (int trial = 0; trial < 5; ++trial) {
    std::shuffle(order.begin(), order.end(), generator);
    Tally tally, parts[3];
    for (std::uint64_t block : order) {
      tally.Add(block, Block(block, kRuns));
      parts[generator() % 3].Add(block, Block(block, kRuns));
    }
    EXPECT_EQ(wanted, tally.ToBytes());
    Tally merged;
    for (int k : {2, 0, 1}) merged.Merge(Tally::FromBytes(parts[k].ToBytes()));
    EXPECT_EQ(wanted, merged.ToBytes());
  }
  // In order: as many as 100 = 64 + 32 + 4 has ones.
  EXPECT_EQ(3u, InOrder().NumNodes());
}

TEST(Tally, TakesNothingTwice) {
  Tally tally;
  for (std::uint64_t block : {4, 5, 6, 7}) tally.Add(block, Block(block, kRuns));
  EXPECT_EQ(1u, tally.NumNodes());
  const std::string before = tally.ToBytes();
  EXPECT_THROW(tally.Add(5, Block(5, kRuns)), std::invalid_argument);
  Tally other;
  other.Add(3, Block(3, kRuns));
  other.Add(7, Block(7, kRuns));
  EXPECT_THROW(tally.Merge(other), std::invalid_argument);
  EXPECT_EQ(before, tally.ToBytes());
}

TEST(Tally, RefusesDamagedBytes) {
  const std::string bytes = InOrder().ToBytes();
  EXPECT_EQ(bytes, Tally::FromBytes(bytes).ToBytes());
  for (std::size_t k = 0; k < bytes.size(); k += 97) {
    std::string damaged = bytes;
    damaged[k] = static_cast<char>(damaged[k] ^ 4);
    EXPECT_THROW(Tally::FromBytes(damaged), std::invalid_argument) << k;
    EXPECT_THROW(Tally::FromBytes(bytes.substr(0, k)), std::invalid_argument) << k;
  }
}

TEST(Summary, PutsEdgesIntoTheBinThatTheyBegin) {
  // Edges low + k (high − low)/bins, and the numbers just below them; the quotient by the width
  // rounds to the wrong side for some.
  const double ranges[][2] = {{0, 1}, {-1, 1}, {0.1, 0.7}, {1e6, 1e6 + 1e-3}, {-1e-9, 3e-9}};
  int checked = 0;
  for (const auto& range : ranges) {
    for (int bins : {1, 3, 7, 10, 100, 977}) {
      Summary summary(1, {{0, range[0], range[1], bins}});
      std::vector<std::uint64_t> wanted(static_cast<std::size_t>(bins) + 2, 0);
      const double width = (range[1] - range[0]) / bins;
      for (int k = 0; k <= bins; ++k) {
        const double edge = k == bins ? range[1] : range[0] + k * width;
        summary.AddMeasured(Vector::Constant(1, edge), "");
        summary.AddMeasured(Vector::Constant(1, std::nextafter(edge, -1e9)), "");
        ++wanted[static_cast<std::size_t>(k) + 1];
        ++wanted[static_cast<std::size_t>(k)];
        ++checked;
      }
      EXPECT_EQ(wanted, summary.histograms[0]) << range[0] << " " << range[1] << " " << bins;
    }
  }
  EXPECT_GT(checked, 5000);
}

TEST(Summary, OfEqualNumbersHasNoSpread) {
  Summary a(1), b(1);
  for (int k = 0; k < 1000; ++k) {
    a.AddMeasured(Vector::Constant(1, 0.1), "");
    b.AddMeasured(Vector::Constant(1, 0.1), "");
  }
  a.Merge(b);
  EXPECT_EQ(0.1, a.mean(0));
  EXPECT_EQ(0, a.Covariance()(0, 0));
  EXPECT_EQ(0.1, a.sketches[0].Quantile(0.5));
  Summary one(1);
  one.AddMeasured(Vector::Constant(1, 2), "");
  EXPECT_TRUE(std::isnan(one.Covariance()(0, 0)));
}

TEST(Summary, KeepsTheFrequentWords) {
  Summary summary(0);
  for (int k = 0; k < 5000; ++k) {
    summary.AddMeasured(Vector(), "often");
    summary.AddMeasured(Vector(), "word " + std::to_string(k));
  }
  EXPECT_EQ(5000u, summary.words.at("often"));
  EXPECT_EQ(Summary::kMaxWords, summary.words.size());
  std::uint64_t sum = summary.other_words;
  for (const auto& [word, count] : summary.words) sum += count;
  EXPECT_EQ(10000u, sum);
}

TEST(Summary, RefusesOtherObservables) {
  Summary a(2), b(3);
  EXPECT_THROW(a.Merge(b), std::invalid_argument);
  EXPECT_THROW(Summary(2, {{2, 0, 1, 4}}), std::invalid_argument);
  EXPECT_THROW(Summary(2, {{0, 1, 1, 4}}), std::invalid_argument);
  EXPECT_THROW(Summary(2, {{0, 0, 1, 0}}), std::invalid_argument);
}

TEST(QuantileSketch, IsExactWhileItHoldsAll) {
  QuantileSketch sketch;
  for (int k = 1000; k > 0; --k) sketch.Add(k);
  EXPECT_EQ(0u, sketch.RankError());
  EXPECT_EQ(1, sketch.Quantile(0));
  EXPECT_EQ(500, sketch.Quantile(0.5));
  EXPECT_EQ(999, sketch.Quantile(0.999));
  EXPECT_EQ(1000, sketch.Quantile(1));
  EXPECT_TRUE(std::isnan(QuantileSketch().Quantile(0.5)));
}

TEST(QuantileSketch, KeepsToItsRankErrorAgainstWhoKnowsIt) {
  // Zeros and ones: of 2 kCapacity sorted values with z zeros a level keeps every other one. Where
  // z is odd, zeros are gained or lost, by what the sketch is to draw next, which is known: here it
  // is looked up on a copy. So every level 0 loses a zero where it can.
  constexpr int kFull = 2 * static_cast<int>(QuantileSketch::kCapacity);
  QuantileSketch sketch;
  std::uint64_t zeros = 0;
  const auto estimate = [](const QuantileSketch& s) {  // zeros, by the largest p that answers 0
    double low = 0, high = 1;
    for (int k = 0; k < 40; ++k) {
      const double p = (low + high) / 2;
      (s.Quantile(p) == 0 ? low : high) = p;
    }
    return low * static_cast<double>(s.count());
  };
  for (int fill = 0; fill < 150; ++fill) {
    double worst = -1;
    int chosen = 0;
    for (int z : {kFull / 2 - 1, kFull / 2, kFull / 2 + 1}) {
      QuantileSketch copy = sketch;
      for (int k = 0; k < kFull; ++k) copy.Add(k >= z);
      const double lost = static_cast<double>(zeros) + z - estimate(copy);
      if (lost > worst) {
        worst = lost;
        chosen = z;
      }
    }
    for (int k = 0; k < kFull; ++k) sketch.Add(k >= chosen);
    zeros += static_cast<std::uint64_t>(chosen);
    const double error = std::abs(static_cast<double>(zeros) - estimate(sketch));
    ASSERT_LE(error, static_cast<double>(sketch.RankError()) + 1e-6) << fill;
  }
}

TEST(QuantileSketch, KeepsToItsRankError) {
  for (int kind = 0; kind < 3; ++kind) {  // at random, sorted, and in two heaps
    const int n = 300000;
    std::vector<double> values;
    Philox random(kind, 0);
    for (int k = 0; k < n; ++k) {
      values.push_back(kind == 0 ? random.Normal() : kind == 1 ? k : k % 2 == 0 ? k : -k);
    }
    std::vector<QuantileSketch> leaves;
    for (int k = 0; k < n; ++k) {
      if (k % 256 == 0) leaves.emplace_back();
      leaves.back().Add(values[static_cast<std::size_t>(k)]);
    }
    while (leaves.size() > 1) {
      std::vector<QuantileSketch> next;
      for (std::size_t k = 0; k < leaves.size(); k += 2) {
        next.push_back(leaves[k]);
        if (k + 1 < leaves.size()) next.back().Merge(leaves[k + 1]);
      }
      leaves = next;
    }
    const QuantileSketch& sketch = leaves[0];
    ASSERT_EQ(static_cast<std::uint64_t>(n), sketch.count());
    std::sort(values.begin(), values.end());
    double worst = 0;
    for (double p = 0.001; p < 1; p += 0.001) {
      const auto place = std::lower_bound(values.begin(), values.end(), sketch.Quantile(p));
      worst = std::max(worst, std::abs((place - values.begin() + 1) - p * n));
    }
    // One more: an answer is a number that there is.
    EXPECT_LE(worst, static_cast<double>(sketch.RankError()) + 1) << kind;
    EXPECT_LE(static_cast<double>(sketch.RankError()) / n, 10.0 / QuantileSketch::kCapacity);
    EXPECT_LE(worst / n, 2.0 / QuantileSketch::kCapacity) << kind;  // what it mostly is
  }
}

}  // namespace
}  // namespace contact_flow
