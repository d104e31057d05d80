// SPDX-License-Identifier: BSD-3-Clause
// Random numbers against recorded values of numpy 1.24, Boost.Math and theory.
#include <gtest/gtest.h>

#include <boost/math/special_functions/erf.hpp>
#include <cmath>
#include <set>
#include <stdexcept>
#include <vector>

#include "contact_flow/ensemble/philox.h"
#include "contact_flow/ensemble/sobol.h"

namespace contact_flow {
namespace {

TEST(Philox, HasNumpysBits) {
  // numpy.random.Philox(key=[seed, run]).random_raw(6)
  const struct {
    std::uint64_t seed, run, bits[6];
  } cases[] = {
      {0u,
       0u,
       {0x2f4ba6408e4d89b, 0x3dd62b0b9ca8c5b2, 0x1c8667a55d902e79, 0x907d7a052fd5b4dc,
        0x809bf322883987c3, 0x471128b9e807f7dd}},
      {1u,
       2u,
       {0x4f2f4313b5536b09, 0x5b617be3219ff32a, 0x97293476f9275cb, 0xf63f3bf4962c3942,
        0x4dcc60473aa0f43, 0x6d905c9b986b0028}},
      {7u,
       1099511627776u,
       {0x53b1782ed0c618ae, 0x9981d8500fb4f54e, 0xec08a634bc9793dd, 0x71bb7db0add142d1,
        0xf4245b2cc842a50, 0x8e699c99abf215ca}},
      {18446744073709551615u,
       5u,
       {0xe2fb87b070c03e6, 0x831b405c123365c0, 0x51d6f209df5de116, 0xfc57a6ec89de5a06,
        0xd008319db13e24b3, 0x84e9aec937797207}},
  };
  for (const auto& c : cases) {
    Philox random(c.seed, c.run);
    for (std::uint64_t bits : c.bits) EXPECT_EQ(bits, random.Next()) << c.seed << " " << c.run;
  }
}

TEST(Philox, IsUniformAsNumpy) {
  // Generator(Philox(key=[7, 3])).random(6)
  const double numpy[] = {0x1.edb31ec618b30p-2, 0x1.72c1e5d4967f1p-1, 0x1.9bae5c02bbd60p-5,
                          0x1.43b6c348a9a9ap-2, 0x1.5c8b1237ef569p-1, 0x1.9002d572e3804p-3};
  Philox random(7, 3);
  for (double u : numpy) EXPECT_EQ(u, random.Uniform());
}

TEST(Philox, CounterCarries) {
  // Streams are 2²⁵⁶ long; what is seen of them here is that blocks differ.
  Philox random(1, 1);
  std::set<std::uint64_t> seen;
  for (int k = 0; k < 4000; ++k) seen.insert(random.Next());
  EXPECT_EQ(4000u, seen.size());
}

TEST(Philox, OpenIntervalHasNoEnds) {
  EXPECT_GT(Philox::OpenInterval(0), 0);
  EXPECT_LT(Philox::OpenInterval(~std::uint64_t{0}), 1);
  EXPECT_EQ(1, Philox::OpenInterval(0) + Philox::OpenInterval(~std::uint64_t{0}));
  EXPECT_TRUE(std::isfinite(NormalQuantile(Philox::OpenInterval(~std::uint64_t{0}))));
}

TEST(NormalQuantile, IsBoosts) {
  // AS 241 states 1e-16; ours adds some roundings of the polynomials and of log, and so does
  // Boost's: 4e-15 in all. Near 1/2 both are relative, too. Below 1e-3 p is exact, above 1 − p is
  // rounded, which Boost's argument is as well.
  const auto boosts = [](double p) { return -std::sqrt(2.0) * boost::math::erfc_inv(2 * p); };
  int checked = 0;
  for (int k = 1; k < 1000; ++k) {
    for (double scale : {1.0, 1e-3, 1e-8, 1e-16, 1e-200}) {
      const double p = k * 1e-3 * scale, z = NormalQuantile(p);
      EXPECT_NEAR(boosts(p), z, 4e-15 * std::abs(z) + 1e-16) << p;
      ++checked;
    }
  }
  EXPECT_EQ(4995, checked);
  EXPECT_EQ(0, NormalQuantile(0.5));
  EXPECT_EQ(-NormalQuantile(0.125), NormalQuantile(0.875));
  EXPECT_TRUE(std::isnan(NormalQuantile(-0.1)) && std::isnan(NormalQuantile(1.1)));
  EXPECT_TRUE(std::isinf(NormalQuantile(0)) && std::isinf(NormalQuantile(1)));
}

TEST(Philox, NormalsHaveTheirMoments) {
  // Of n = 2·10⁵ runs: mean within 5/√n, variance 5 √(2/n), fourth moment 3 within 5 √(96/n).
  const int n = 200000;
  double sum[5] = {};
  for (int run = 0; run < n; ++run) {
    const double z = Philox(5, static_cast<std::uint64_t>(run)).Normal();
    for (int k = 1; k < 5; ++k) sum[k] += std::pow(z, k) / n;
  }
  EXPECT_NEAR(0, sum[1], 5 / std::sqrt(n));
  EXPECT_NEAR(1, sum[2], 5 * std::sqrt(2.0 / n));
  EXPECT_NEAR(3, sum[4], 5 * std::sqrt(96.0 / n));
}

TEST(Sobol, HasThePointsOfJoeAndKuo) {
  // The first points of new-joe-kuo-6 in three dimensions, as their authors print them.
  const double points[8][3] = {{0, 0, 0},          {.5, .5, .5},       {.75, .25, .25},
                               {.25, .75, .75},    {.375, .375, .625}, {.875, .875, .125},
                               {.625, .125, .875}, {.125, .625, .375}};
  const ShiftedSobol sobol(3, 0, false);
  for (int k = 0; k < 8; ++k) {
    for (int d = 0; d < 3; ++d) {
      EXPECT_EQ(points[k][d], Philox::UnitInterval(sobol.Bits(static_cast<std::uint64_t>(k), d)));
    }
  }
}

TEST(Sobol, HasScipysPointsInHighDimensions) {
  // Upper 32 bits of scipy.stats.qmc.Sobol(3667, scramble=False, bits=32), scipy 1.10, whose
  // direction numbers are those of Joe and Kuo (2008), too.
  constexpr int kDimensions[] = {0, 39, 500, 1110, 2000, 3000, 3666};
  const struct {
    std::uint64_t k, bits[7];
  } cases[] = {
      {1, {2147483648, 2147483648, 2147483648, 2147483648, 2147483648, 2147483648, 2147483648}},
      {2, {3221225472, 1073741824, 1073741824, 3221225472, 1073741824, 3221225472, 1073741824}},
      {3, {1073741824, 3221225472, 3221225472, 1073741824, 3221225472, 1073741824, 3221225472}},
      {5, {3758096384, 1610612736, 3758096384, 1610612736, 3758096384, 1610612736, 536870912}},
      {100, {1778384896, 570425344, 771751936, 1979711488, 637534208, 1509949440, 2181038080}},
      {12345, {2752774144, 4072407040, 1299447808, 1851523072, 3182166016, 1471938560, 3524001792}},
      {1048583,
       {536877056, 2013718528, 3935193088, 3934697472, 2584496128, 2932647936, 3120654336}},
  };
  const ShiftedSobol sobol(ShiftedSobol::kMaxDimension, 0, false);
  for (const auto& c : cases) {
    for (int d = 0; d < 7; ++d) {
      EXPECT_EQ(c.bits[d], sobol.Bits(c.k, kDimensions[d]) >> 32) << c.k << " " << d;
    }
  }
}

TEST(Sobol, IsEvenlySpreadAnywhere) {
  // 2ᵐ points from a multiple of 2ᵐ on: one in each of 2ᵐ intervals, in every dimension.
  const ShiftedSobol sobol(40, 9);
  for (std::uint64_t first : {std::uint64_t{0}, std::uint64_t{1} << 20, std::uint64_t{3} << 55}) {
    for (int d = 0; d < 40; ++d) {
      std::set<int> cells;
      for (std::uint64_t k = first; k < first + 256; ++k) {
        cells.insert(static_cast<int>(256 * Philox::UnitInterval(sobol.Bits(k, d))));
      }
      EXPECT_EQ(256u, cells.size()) << d;
    }
  }
}

TEST(Sobol, IntegratesBetterThanChance) {
  // ∏ (1 + (x_d − ½)/2) over 5 dimensions is 1; by n random points the error is some
  // 0.33/√n = 1e-3 at n = 2¹⁶: variance (1 + 1/48)⁵ − 1 = 0.108.
  const int n = 1 << 16;
  const ShiftedSobol sobol(5, 3);
  double sum = 0;
  for (int k = 0; k < n; ++k) {
    double product = 1;
    for (int d = 0; d < 5; ++d) {
      const double x = Philox::UnitInterval(sobol.Bits(static_cast<std::uint64_t>(k), d));
      product *= 1 + (x - 0.5) / 2;
    }
    sum += product / n;
  }
  EXPECT_NEAR(1, sum, 1e-5);
}

TEST(Sobol, ShiftsDifferBySeed) {
  EXPECT_NE(ShiftedSobol(2, 1).Bits(0, 0), ShiftedSobol(2, 2).Bits(0, 0));
  EXPECT_NE(ShiftedSobol(2, 1).Bits(0, 0), ShiftedSobol(2, 1).Bits(0, 1));
  EXPECT_THROW(ShiftedSobol(0, 1), std::invalid_argument);
  EXPECT_THROW(ShiftedSobol(4000, 1), std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
