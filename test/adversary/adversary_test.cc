// SPDX-License-Identifier: BSD-3-Clause
// Random systems far beyond what the laws of the other tests use, judged by a simulator of its own.
//   CONTACT_FLOW_ADVERSARY_SYSTEMS, _SEED, _THREADS   how many, from which seed, with how many
//   CONTACT_FLOW_ADVERSARY_PRINT=1                    prints each case, and its verdict
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "test/adversary/campaign.h"
#include "test/adversary/draw.h"

namespace contact_flow {
namespace adversary {
namespace {

long Environment(const char* name, long otherwise) {
  const char* value = std::getenv(name);
  return value != nullptr ? std::atol(value) : otherwise;
}

/// The derivatives of a random system are those of its formulas, in other units, too.
TEST(RandomSystem, HasItsDerivatives) {
  int cases = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Case c = Generate(seed);
    if (!c.skipped.empty() || c.system->coefficients().ridges.size() > 3) continue;
    ++cases;
    const RescaledSystem given(*c.system, c.units);
    const int d = given.dof(), n = given.num_constraints(), m = given.num_inputs();
    Draw draw(seed);
    const auto random = [&](int size) {
      Vector x(size);
      for (int i = 0; i < size; ++i) x(i) = draw.Normal();
      return x;
    };
    // All arguments in units of order 1, then in the given ones.
    const Units& units = c.units;
    const auto state = [&](const Vector& x) { return units.State(x); };
    const Vector x0 = c.x + 0.01 * random(2 * d), u = random(m);
    const Vector a0 = random(d), f0 = random(n), s0 = random(d);
    Vector zero_a(2 * d), zero_s(2 * d);
    zero_a << Vector::Zero(d), a0;
    zero_s << Vector::Zero(d), s0;
    const Vector acceleration = state(zero_a).tail(d) / units.time, s = state(zero_s).tail(d);
    const double energy = units.mass / (units.time * units.time);
    Vector force(n), impulse(n), gap_unit(n);
    for (int i = 0; i < n; ++i) {
      force(units.constraint[i]) = energy / units.gap(i) * f0(i);
      gap_unit(units.constraint[i]) = units.gap(i);
    }
    impulse = force * units.time;
    // Residuals in units of order 1, from the given system.
    const auto residual = [&](const Vector& x, bool impact) {
      const Vector y = state(x);
      Matrix mass;
      Vector applied;
      ConstraintTerms terms;
      given.Dynamics(y.head(d), y.tail(d), u, {}, &mass, &applied);
      given.Constraints(y.head(d), y.tail(d), &terms);
      Vector r(d + n);
      if (impact) {
        r << mass * s - terms.jacobian.transpose() * impulse, terms.jacobian * s;
      } else {
        r << mass * acceleration - applied - terms.jacobian.transpose() * force,
            terms.jacobian * acceleration + terms.bias;
      }
      return r;
    };
    for (const bool impact : {false, true}) {
      const Vector y = state(x0);
      ResidualJacobian J;
      if (impact) {
        given.DifferentiateImpact(y.head(d), s, impulse, s, &J);
      } else {
        given.DifferentiateDynamics(y.head(d), y.tail(d), u, {}, acceleration, force, &J);
      }
      const Vector w = random(2 * d).cwiseProduct(
          impact ? Vector((Vector(2 * d) << Vector::Ones(d), Vector::Zero(d)).finished())
                 : Vector::Ones(2 * d));
      const Vector dw = state(w);
      Vector exact(d + n);
      exact << J.momentum_q * dw.head(d), J.constraint_q * dw.head(d);
      if (!impact)
        exact +=
            (Vector(d + n) << J.momentum_v * dw.tail(d), J.constraint_v * dw.tail(d)).finished();
      // The narrowest ridge sets the step: central differences, error (h/width)²/6.
      const double h = 1e-6 * std::min(1.0, c.system->TimeScale(x0.head(d), w.head(d)));
      const Vector difference =
          (residual(x0 + h * w, impact) - residual(x0 - h * w, impact)) / (2 * h);
      const Vector here = residual(x0, impact);
      for (int i = 0; i < d + n; ++i) {
        // Rounding of the residual's terms, which are larger than their sum, over h.
        const double size =
            std::max({std::abs(exact(i)), std::abs(here(i)), exact.cwiseAbs().maxCoeff() * 1e-12});
        EXPECT_NEAR(exact(i), difference(i), 1e-3 * size)
            << "seed " << seed << (impact ? ", impact" : ", dynamics") << ", row " << i;
      }
    }
    if (HasFailure()) break;
  }
  EXPECT_GT(cases, 100);
}

struct Former {
  std::uint64_t seed;
  Verdict::Kind now;
  const char* why;
  const char* told = "";  // of a refusal: its own reason, not any
};
constexpr auto kRight = Verdict::Kind::kRight, kRefused = Verdict::Kind::kRefused;
constexpr auto kSkipped = Verdict::Kind::kSkipped;

void ExpectVerdict(const Former& former, const Verdict& verdict) {
  EXPECT_EQ(former.now, verdict.kind)
      << "seed " << former.seed << ", " << former.why << ": " << Name(verdict.kind) << ", "
      << verdict.reason << " " << verdict.detail;
  EXPECT_NE(std::string::npos, verdict.detail.find(former.told))
      << "seed " << former.seed << ": " << verdict.detail;
}

/// Systems whose answers were wrong once, and why; none of the other tests has their like.
TEST(Adversary, WhatWasWrongOnce) {
  const Former formers[] = {
      {88, kRight, "forces of 1e-5 N counted as zero beside 1 N"},
      {1210, kRight, "forces of 1e-13 N"},
      {66, kRight, "steps that never grew where all forces were below the floor"},
      {1648, kRight, "errors of instants that doubled with each bounce"},
      {447, kRight, "tangents in units of which one hides the other"},
      {3364, kRight, "a small impulse by projection that counted as none"},
      {11, kRight, "a field at rest that is nothing but rounding"},
      {3458, kRefused, "an estimated error that was no number", "moves"},
      {426, kRefused, "a contact that holds without a force", "neither pressed nor lifted"},
      {2428, kRefused, "a start that leaves by less than is known",
       "neither leaves nor is pressed"},
      {706, kRefused, "a dip that closes by no more than its error",
       "opens again within its error"},
      {173888, kRefused, "a touchdown of less than the tolerance, behind an impact elsewhere",
       "by an impact elsewhere and opens again"},
      {191583, kRefused,
       "by projection, a contact that had let go and was held at another's impact",
       "their order is not known"},
      {2457, kRefused, "events whose order errors of the state do not tell",
       "their order is not known"},
      {100702, kRefused, "a contact that is thrown up, 3e-18 m, when the next one is hit",
       "too slowly to be resolved"},
      {601756, kRefused, "a crash: bounces made rest behind an impact that lifts all",
       "accumulate"},
  };
  for (const Former& former : formers) {
    ExpectVerdict(former, Judge(Generate(former.seed)));
  }
}

/// The same under options that are drawn; what the judge was wrong about is not contradicted now.
TEST(Adversary, WhatWasWrongOnceByDrawnOptions) {
  const Former formers[] = {
      {400921, kRight, "an arc that is no step, but an event 6e-11 s later: a null pointer"},
      {8003883, kRefused, "the same by the implicit method, 2e-12 s later: without an extension",
       "their order is not known"},
      {8007499, kRight, "hops lower than the reference tells gaps apart, held against B"},
      {9015075, kSkipped, "a contact met at 5e-8 m/s: B is known to 1e-6, and was held to 1e-7"},
      {9062239, kRefused, "velocities known to 1e-4 behind a gust: B tells a third of its error",
       "their order is not known"},
  };
  for (const Former& former : formers) {
    ExpectVerdict(former, Judge(GenerateWithOptions(former.seed)));
  }
}

TEST(Adversary, IsNotContradicted) {
  const long systems = Environment("CONTACT_FLOW_ADVERSARY_SYSTEMS", 200);
  const long seed = Environment("CONTACT_FLOW_ADVERSARY_SEED", 1);
  const int threads = static_cast<int>(Environment("CONTACT_FLOW_ADVERSARY_THREADS", 1));
  if (Environment("CONTACT_FLOW_ADVERSARY_PRINT", 0) != 0) {
    for (long k = 0; k < systems; ++k) {
      const Case c = GenerateWithOptions(static_cast<std::uint64_t>(seed + k));
      const Verdict verdict = Judge(c);
      std::cout << Print(c) << Name(verdict.kind) << ": " << verdict.reason << " " << verdict.detail
                << "\n";
    }
    return;
  }
  const Campaign campaign = RunCampaign(static_cast<std::uint64_t>(seed), systems, threads);
  campaign.Print(&std::cout);
  EXPECT_TRUE(campaign.contradicted.empty());
}

}  // namespace
}  // namespace adversary
}  // namespace contact_flow
