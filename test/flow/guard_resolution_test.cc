// SPDX-License-Identifier: BSD-3-Clause
// Guards that are far quicker than the motion, on motions of closed form: a ball in free fall over
// waves, a block at rest under a force that follows a clock.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "test/flow/first_zero.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::FirstZero;
using test::kGravity;

/// A ball in free fall over z = amplitude sin(wave x).
struct Waves : test::UnitMasses<2, 1> {
  static constexpr bool kAffineConstraints = false;
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "z"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"ground"};
  static constexpr const char* kName = "waves";
  template <class P>
  struct Parameters {
    P amplitude = 0.1, wave = 20, restitution = 0.8;
    template <class V>
    void Visit(V&& visit) {
      visit(amplitude, "amplitude", "m", "of the ground", Range::kPositive);
      visit(wave, "wave", "rad/m", "wave number", Range::kPositive);
      visit(restitution, "restitution", "", "of the ground", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void Force(const P&, const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 0, 1>&, Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(0.0);
    (*f)(1) = S(-kGravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    using std::sin;
    (*a)(0) = q(1) - p.amplitude * sin(p.wave * q(0));
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }
};

/// A block on a floor, λ/unit = load − drift w + cos w, with w a clock: many periods pass
/// before it lets go.
struct Shaken : test::UnitMasses<2, 1> {
  static constexpr const char* kName = "shaken";
  static constexpr std::array<const char*, 2> kCoordinates = {"y", "clock"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "rad"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  template <class P>
  struct Parameters {
    P unit = 1, load = 1, drift = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(unit, "unit", "", "of force", Range::kPositive);
      visit(load, "load", "N", "at first", Range::kAny);
      visit(drift, "drift", "N/rad", "of the load", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    using std::cos;
    (*f)(0) = p.unit * (p.drift * q(1) - p.load - cos(q(1)));
    (*f)(1) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(0);
  }
};

/// The parabola from (x, z, ẋ, ż) over the waves.
struct Flight {
  double amplitude, wave;
  Eigen::Vector4d from;

  Eigen::Vector4d At(double t) const {
    return {from(0) + from(2) * t, from(1) + from(3) * t - kGravity * t * t / 2, from(2),
            from(3) - kGravity * t};
  }
  double Gap(double t) const {
    const Eigen::Vector4d x = At(t);
    return x(1) - amplitude * std::sin(wave * x(0));
  }
  double Speed(const Eigen::Vector4d& x) const {
    return x(3) - amplitude * wave * std::cos(wave * x(0)) * x(2);
  }
  /// A thousand steps a wave, at least.
  double Touchdown(double end) const {
    const double step = std::min(1e-4, 6e-3 / (1e-9 + std::abs(wave * from(2))));
    return FirstZero([&](double t) { return Gap(t); }, step, end);
  }
  /// v⁺ = v⁻ − (1+γ) n (n·v⁻)/(n·n), n = (−h′, 1).
  Flight Bounce(double t, double restitution) const {
    Eigen::Vector4d x = At(t);
    const Eigen::Vector2d n(-amplitude * wave * std::cos(wave * x(0)), 1);
    x.tail(2) -= (1 + restitution) * n.dot(x.tail(2)) / n.squaredNorm() * n;
    return {amplitude, wave, x};
  }
};

TEST(QuickGaps, TheWavesOfTheReport) {
  const auto robot = LoadRobot(std::string(CONTACT_FLOW_TEST_DATA) + "/waves.yaml");
  const Trajectory nominal = Simulate(*robot, robot->nominal().x, Vector(0), 0.6);
  ASSERT_FALSE(nominal.transitions.empty());
  EXPECT_NEAR(0.44418, nominal.transitions.front().t, 1e-5);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  SimulateOptions options;
  options.max_events = 1;
  for (int k = 0; k < 48; ++k) {
    // Phase by the place where it starts, frequency by its speed: up to 800 rad/s.
    Vector x(4);
    x << uniform(random), 0.15 + uniform(random), 40 * uniform(random), 2 * uniform(random) - 1;
    const Trajectory run = Simulate(*robot, x, Vector(0), 1, options);
    const double truth = Flight{0.1, 20, x}.Touchdown(1);
    ASSERT_FALSE(run.transitions.empty()) << "run " << k;
    // The state is right to 1e-9, the slowest touchdown's speed is about 0.1 m/s.
    EXPECT_NEAR(truth, run.transitions.front().t, 1e-8) << "run " << k;
  }
}

/// A ball that hops by less than the tolerance, 5e-8 m for 1e-6: it lands where its parabola does,
/// not where the step ends that it lands in.
TEST(LowHops, EndWhereTheyLand) {
  const double speed = 1e-3, period = 2 * speed / kGravity;
  const auto ball = MakeModel("bouncing_ball", {{"gravity", kGravity}, {"restitution", 1}});
  Vector x = Vector::Zero(4);
  x(3) = speed;
  for (const double steps : {2.7, 3.3, 7.1, 40.3}) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-6;
    options.max_step = period / steps;
    const Trajectory run = Simulate(*ball, x, Vector(0), 3.5 * period, options);
    ASSERT_EQ(3u, run.transitions.size()) << steps << ' ' << run.status.message;
    for (int k = 0; k < 3; ++k) {
      // Parabolas are integrated to rounding, 1e-19 m, over the speed.
      EXPECT_NEAR((k + 1) * period, run.transitions[k].t, 1e-14) << steps;
    }
  }
}

TEST(QuickGaps, WavesOfAnyFrequencyAndRestitution) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  int compared = 0;
  for (int k = 0; k < 300; ++k) {
    // 1 to 2000 rad/s.
    const double frequency = std::pow(10, 3.3 * uniform(random)), speed = 0.5 + 5 * uniform(random);
    const double wave = frequency / speed, amplitude = 0.005 + 0.2 * uniform(random);
    const double restitution = k % 4 / 3.0;
    Vector x(4);
    x << uniform(random), amplitude + 0.01 + 0.5 * uniform(random), speed, uniform(random) - 0.5;
    const auto system =
        test::Make<Waves>({{"amplitude", amplitude}, {"wave", wave}, {"restitution", restitution}});
    SimulateOptions options;
    options.max_events = restitution > 0 ? 2 : 1;
    const Trajectory run = Simulate(system, x, Vector(0), 1, options);
    Flight flight{amplitude, wave, x};
    double begin = 0, uncertain = 1e-9;
    for (int bounce = 0; bounce < options.max_events; ++bounce) {
      const double truth = flight.Touchdown(1 - begin);
      if (truth > 1 - begin) break;
      // Slower than 0.03 m/s a touchdown is close to grazing: not compared.
      if (flight.Speed(flight.At(truth)) > -0.03) break;
      ASSERT_LT(bounce, run.transitions.size()) << "run " << k << ": " << run.status.message;
      // The state is right to 1e-9, so the time to 1e-9 s over 0.03.
      ASSERT_NEAR(begin + truth, run.transitions[bounce].t, 40 * uncertain)
          << "run " << k << ", frequency " << frequency << ", bounce " << bounce;
      ++compared;
      // What an error of 1e-9 s at the bounce makes of the next.
      const Flight next = flight.Bounce(truth, restitution);
      const Flight late = flight.Bounce(truth + 1e-9, restitution);
      const double change = late.Touchdown(1) + 1e-9 - next.Touchdown(1);
      if (!(std::abs(change) < 1e-5)) break;  // a crest that is missed by a hair
      begin += truth;
      uncertain += 10 * std::abs(change);
      flight = next;
    }
  }
  EXPECT_GT(compared, 300);
}

/// λ = load + cos(ωt + φ) on a block at rest, 1 to 2000 rad/s: released when it vanishes, down
/// again when the double integral of −load − cos does.
TEST(QuickForces, ABlockAtRestIsReleasedByAClock) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  options.max_events = 2;
  for (int k = 0; k < 200; ++k) {
    const double omega = k == 0 ? 200 : std::pow(10, 3.3 * uniform(random));
    const double load = 0.2 + 0.6 * uniform(random), release = std::acos(-load);
    const double phase = release * (2 * uniform(random) - 1);
    const auto system = test::Make<test::PressedBlock>({{"load", load}});
    Vector x(4);
    x << 0, phase, 0, omega;
    const Trajectory run = Simulate(system, x, Vector(0), 8 + 20 / omega, options);
    ASSERT_LE(2u, run.transitions.size()) << "ω = " << omega << ": " << run.status.message;
    EXPECT_EQ(ConstraintSet({0}), run.transitions[0].released);
    // λ is known to rounding: 1e-15 over its slope, 0.6 ω.
    EXPECT_NEAR((release - phase) / omega, run.transitions[0].t, 1e-12) << "ω = " << omega;
    const double step = 1e-4 / omega;
    const auto height = [&](double t) {
      const double now = release + omega * t;
      return (-load * omega * omega * t * t / 2 + std::cos(now) - std::cos(release) +
              std::sin(release) * omega * t);
    };
    // In units of 1/ω²: −1e-9 lies 1e-9 below, its slope is about 1.
    const double flight = FirstZero(height, step, 20 / omega);
    // A state right to 1e-12 over a speed of about 0.3/ω.
    EXPECT_NEAR(run.transitions[0].t + flight, run.transitions[1].t, 1e-9 / omega + 1e-11 * omega)
        << "ω = " << omega;
  }
}

/// The force is quicker than any step that the motion asks for, and vanishes late.
TEST(QuickForces, ABlockAtRestIsReleasedLate) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform(0, 1);
  SimulateOptions options;
  options.max_events = 1;
  for (int k = 0; k < 200; ++k) {
    const double omega = k == 0 ? 200 : std::pow(10, 3.3 * uniform(random));
    const double load = 1.1 + 3 * uniform(random), drift = 1e-3 * (1 + 9 * uniform(random));
    const auto force = [&](double w) { return load - drift * w + std::cos(w); };
    const double release = FirstZero(force, 1e-3, 1e4) / omega;
    const auto system = test::Make<Shaken>({{"load", load}, {"drift", drift}});
    Vector x(4);
    x << 0, 0, 0, omega;
    const Trajectory run = Simulate(system, x, Vector(0), 1.1 * release, options);
    ASSERT_FALSE(run.transitions.empty()) << "ω = " << omega << ": " << run.status.message;
    // λ is known to rounding and slopes, at the shallowest, like √(2·1e-6) ω.
    EXPECT_NEAR(release, run.transitions[0].t, 1e-8 / omega) << "ω = " << omega;
  }
}

/// Nothing but the forces themselves tells what a small one is.
TEST(QuickForces, ABlockAtRestIsReleasedWhateverTheUnit) {
  const double load = 0.5, omega = 3, release = std::acos(-load) / omega;
  SimulateOptions options;
  options.max_events = 1;
  for (const double unit : {1e-10, 1e-6, 1e-3, 1e3, 1e10}) {
    const auto system = test::Make<Shaken>({{"unit", unit}, {"load", load}});
    Vector x(4);
    x << 0, 0, 0, omega;
    const Trajectory run = Simulate(system, x, Vector(0), 1, options);
    ASSERT_FALSE(run.transitions.empty()) << "unit " << unit;
    EXPECT_NEAR(release, run.transitions[0].t, 1e-8) << "unit " << unit;
  }
}

/// A force that varies without end but never vanishes is no release, and no stop.
TEST(QuickForces, ThatNeverVanishHold) {
  const auto system = test::Make<test::PressedBlock>({{"load", 1.01}});
  Vector x(4);
  x << 0, 0, 0, 500;
  const Trajectory run = Simulate(system, x, Vector(0), 2);
  EXPECT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_TRUE(run.transitions.empty());
  EXPECT_NEAR(0.01, run.margins.force, 1e-3);
}

/// An online run, looked at every 13 ms, finds the same events, to the bit.
void ExpectTheSameOnline(const std::shared_ptr<const MechanicalSystem>& system, const Vector& x,
                         double end) {
  const Trajectory run = Simulate(*system, x, Vector(0), 3 * end);
  OnlineFlow online(system, 0, x, Vector(0), {});
  std::size_t seen = 0;
  for (double t = 0; t < end && online.status().ok();) {
    if (online.AdvanceTo(t)) {
      ASSERT_LT(seen, run.transitions.size());
      EXPECT_EQ(run.transitions[seen].t, online.transition().t);
      EXPECT_EQ(run.transitions[seen].x_plus, online.transition().x_plus);
      ++seen;
    } else {
      t += 0.013;
    }
  }
  EXPECT_GT(seen, 0u);
}

TEST(QuickGuards, AreTheSameOnline) {
  const std::shared_ptr<const MechanicalSystem> waves =
      LoadRobot(std::string(CONTACT_FLOW_TEST_DATA) + "/waves.yaml");
  ExpectTheSameOnline(waves, waves->nominal().x, 0.6);
  const auto shaken =
      std::make_shared<ModelSystem<Shaken>>(ParameterValues{{"load", 2.0}, {"drift", 0.01}});
  Vector x(4);
  x << 0, 0, 0, 200;
  ExpectTheSameOnline(shaken, x, 0.6);
}

}  // namespace
}  // namespace contact_flow
