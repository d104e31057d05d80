// SPDX-License-Identifier: BSD-3-Clause
// The gradient of a cost beside closed forms, quotients and forward columns.
#include "contact_flow/derivative/cost_gradient.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "contact_flow/derivative/grid_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/derivative/input_cases.h"
#include "test/reference_case.h"

namespace contact_flow {
namespace {

using test::WithSimultaneity;

BDerivativeOptions Options(bool inputs, std::vector<int> parameters = {}) {
  BDerivativeOptions options;
  options.tolerance = 1e-12;
  options.variables = {inputs, std::move(parameters)};
  return options;
}

/// A cost that is a covector of the final state's numbers.
RunCost Covector(const Vector& c) {
  RunCost cost;
  cost.terminal = [c](const Vector& x, Vector* by_state) {
    *by_state = c;
    return c.dot(x);
  };
  return cost;
}

Vector Random(Eigen::Index size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Vector::NullaryExpr(size, [&] { return uniform(random); });
}

/// A bouncing ball with one bounce: J by y(0), v(0), gravity and restitution in closed form.
long double BallCost(long double y, long double v, long double g, long double e, long double T) {
  const long double down = std::sqrt(v * v + 2 * g * y), hit = (v + down) / g, up = e * down;
  const long double rest = T - hit, end = up * rest - g * rest * rest / 2, speed = up - g * rest;
  const auto third = [](long double x) { return x * x * x / 3; };
  // ½·2·(end − 0.4)² + ½·0.5·speed² + ½·0.3·∫ v² dt, v falling from v to −down, and from up on.
  return (end - 0.4L) * (end - 0.4L) + 0.25L * speed * speed +
         0.15L * ((third(v) + third(down)) + (third(up) - third(speed))) / g;
}

/// The running cost depends on the velocity, which jumps: l⁻ ≠ l⁺ at the bounce.
TEST(CostGradient, OfABouncingBallHasTheClosedForm) {
  const auto ball = MakeModel("bouncing_ball");
  Vector x(4);
  x << 0, 0.5, 0.3, 0.2;
  const double T = 0.6;
  const Trajectory run = Simulate(*ball, x, Vector(), T, WithSimultaneity(0));
  ASSERT_EQ(1u, run.transitions.size());
  QuadraticCost cost;
  cost.weight = Vector::Zero(4);
  cost.weight << 0, 2, 0, 0.5;
  cost.target = Vector::Zero(4);
  cost.target(1) = 0.4;
  cost.state_weight = Vector::Zero(4);
  cost.state_weight(3) = 0.3;
  const CostGradient J = DifferentiateCost(*ball, run, cost.Make(*ball), Options(false, {1, 2}));
  ASSERT_TRUE(J.status.ok()) << J.status.message;
  EXPECT_TRUE(J.whole);
  long double p[] = {0.5L, 0.2L, 9.81L, 0.7L, 0.6L};
  const auto value = [&] { return BallCost(p[0], p[1], p[2], p[3], p[4]); };
  // The run is right to about 1e-12 and the closed form to rounding; central quotients in extended
  // precision leave h² ~ 1e-12 and 1e-19/h ~ 1e-13.
  EXPECT_NEAR(static_cast<double>(value()), J.cost, 1e-11);
  const double found[] = {J.initial(1), J.initial(3), J.parameters(0), J.parameters(1), J.horizon};
  for (int i = 0; i < 5; ++i) {
    const long double h = 1e-6L, at = p[i];
    p[i] = at + h;
    const long double plus = value();
    p[i] = at - h;
    const long double minus = value();
    p[i] = at;
    EXPECT_NEAR(static_cast<double>((plus - minus) / (2 * h)), found[i], 1e-10) << i;
  }
  EXPECT_EQ(0, J.initial(0));
}

/// Quotients in quadruple precision by an independent program, through simultaneous touchdowns.
TEST(CostGradient, OfTheDirectionsPieceAgreesWithReferences) {
  int kinks = 0, compared = 0;
  for (const std::string& name : test::ReferenceNames()) {
    const test::ReferenceCase c(name);
    if (c.derivatives.empty()) continue;
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    const Trajectory run = Simulate(*c.system, c.x, c.u, c.duration, options);
    const Vector covector = Random(c.system->state_size(), 3);
    const RunCost cost = Covector(covector);
    for (const auto& d : c.derivatives) {
      RunDirection w;
      w.initial = d.direction;
      const CostGradient J = DifferentiateCost(*c.system, run, cost, Options(false), &w);
      ASSERT_TRUE(J.status.ok()) << name << ": " << J.status.message;
      kinks += !J.whole;
      ++compared;
      // As BDerivative: state 1e-10, and the derivatives of state_size numbers.
      EXPECT_NEAR(covector.dot(d.derivative), J.Along(w), 1e-8 * c.DerivativeScale()) << name;
      EXPECT_LT(J.law, 1e-9) << name;
    }
    const CostGradient alone = DifferentiateCost(*c.system, run, cost, Options(false));
    const BDerivative B = DifferentiateOutcome(*c.system, run);
    EXPECT_EQ(B.IsDifferentiable(), alone.status.ok()) << name << alone.status.message;
    if (!alone.status.ok()) EXPECT_EQ(Outcome::kNotPiecewiseLinear, alone.status.outcome);
  }
  EXPECT_GT(kinks, 10);
  EXPECT_GT(compared, kinks);
}

/// ∫ l dt along the dense motion, by the midpoint rule with Richardson's steps inside each arc:
/// nothing of it is derived from derivatives.
template <class Rate>
double Integral(const Trajectory& run, const Rate& l) {
  double sum = 0;
  for (const Arc& arc : run.arcs) {
    if (!(arc.t_end > arc.t_begin)) continue;
    const auto midpoint = [&](int n) {
      double total = 0;
      Vector x = arc.x_begin;
      const double h = (arc.t_end - arc.t_begin) / n;
      for (int i = 0; i < n; ++i) {
        arc.dense.Evaluate(arc.t_begin + (i + 0.5) * h, x.data());
        total += h * l(x, arc.u);
      }
      return total;
    };
    const double a = midpoint(12), b = midpoint(24), c = midpoint(48);
    const double ab = (4 * b - a) / 3, bc = (4 * c - b) / 3;
    sum += (16 * bc - ab) / 15;
  }
  return sum;
}

/// Random cases in which the input changes at touchdowns, with a running cost by velocities and
/// inputs: one-sided quotients with slope one. Their error is C α; rounding leaves 1e-12/α.
TEST(CostGradient, WhereInputsChangeAtTouchdownsAgreesWithQuotients) {
  constexpr double kCoarse = 1e-4, kFine = 1e-5, kNoise = 1e-6;
  int answered = 0, refused = 0;
  for (int seed = 0; seed < 18; ++seed) {
    const test::Case c = test::RandomCase(seed).Make();
    const Trajectory run = Simulate(*c.system, c.x, c.schedule, c.duration, WithSimultaneity(1e-9));
    QuadraticCost quadratic;
    quadratic.weight = Random(6, 40).cwiseAbs();
    quadratic.target = Random(6, 41);
    quadratic.state_weight = Random(6, 42).cwiseAbs();
    quadratic.state_reference = Random(6, 43);
    quadratic.input_weight = Random(2, 44).cwiseAbs();
    const auto cost_of = [&](const Trajectory& of) {
      const Vector e = of.FinalState() - quadratic.target;
      return 0.5 * quadratic.weight.dot(e.cwiseAbs2()) +
             Integral(of, [&](const Vector& x, const Vector& u) {
               const Vector off = x - quadratic.state_reference;
               return 0.5 * quadratic.state_weight.dot(off.cwiseAbs2()) +
                      0.5 * quadratic.input_weight.dot(u.cwiseAbs2());
             });
    };
    const auto K = static_cast<Eigen::Index>(c.schedule.grid.size());
    for (unsigned j = 0; j < 4; ++j) {
      RunDirection w;
      w.initial = Random(6, 100 * static_cast<unsigned>(seed) + j);
      if (c.x(2) == 0) w.initial(2) = w.initial(5) = 0;  // it rests on its floor
      const Vector u = Random(2 * K, 7000 + 100 * static_cast<unsigned>(seed) + j);
      w.inputs = Eigen::Map<const Matrix>(u.data(), 2, K);
      const CostGradient J =
          DifferentiateCost(*c.system, run, quadratic.Make(*c.system), Options(true), &w);
      if (!J.status.ok()) {
        ++refused;
        continue;
      }
      ++answered;
      EXPECT_LT(J.law, 1e-8) << seed;
      EXPECT_NEAR(cost_of(run), J.cost, 1e-9 * (1 + J.cost)) << seed;
      const auto value = [&](double alpha) {
        InputSchedule schedule = c.schedule;
        for (Eigen::Index k = 0; k < K; ++k) {
          schedule.values[static_cast<std::size_t>(k)] += alpha * w.inputs.col(k);
        }
        return cost_of(Simulate(*c.system, c.x + alpha * w.initial, schedule, c.duration,
                                WithSimultaneity(1e-13)));
      };
      const double base = value(0), exact = J.Along(w);
      const auto error = [&](double alpha) {
        return std::abs((value(alpha) - base) / alpha - exact);
      };
      const double coarse = error(kCoarse), fine = error(kFine);
      EXPECT_LT(fine, 0.3 * coarse + kNoise * (1 + std::abs(exact))) << seed << " " << j;
      EXPECT_LT(coarse, 0.05 * (1 + std::abs(exact))) << seed << " " << j;
    }
  }
  EXPECT_GT(answered, 4 * refused);
  std::printf("%d directions answered, %d refused\n", answered, refused);
}

/// All columns of the forward derivative of a run in space, with rotations, inputs and events, and
/// its instants: equal to 1e-9 of the largest.
TEST(CostGradient, EqualsForwardColumns) {
  const auto box = MakeModel("falling_box");
  const int d = box->dof(), m = box->num_inputs();
  InputSchedule schedule;
  schedule.grid = {0, 0.1, 0.3};
  for (int k = 0; k < 3; ++k) {
    schedule.values.push_back(0.3 * Vector::LinSpaced(m, -1, 1 + k));
    schedule.values.back().tail(3) *= 0.01;
  }
  const Trajectory run = Simulate(*box, box->nominal().x, schedule, 0.41, WithSimultaneity(0));
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const Vector covector = Random(box->state_size(), 5);
  const CostGradient J = DifferentiateCost(*box, run, Covector(covector), Options(true));
  ASSERT_TRUE(J.status.ok()) << J.status.message;
  const GridDerivative B(*box, run, Options(true));
  const Vector by_tangents = ByTangents(*box, run.FinalState(), covector);
  const double size = std::max(J.initial.cwiseAbs().maxCoeff(), J.inputs.cwiseAbs().maxCoeff());
  ASSERT_EQ(3, J.inputs.cols());
  ASSERT_EQ(2, J.instants.size());
  const Vector none = Vector::Zero(2 * d);
  const Matrix no_input = Matrix::Zero(m, 3);
  for (int i = 0; i < 2 * d; ++i) {
    EXPECT_NEAR(by_tangents.dot(B(Vector::Unit(2 * d, i), no_input)), J.initial(i), 1e-9 * size);
  }
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < m; ++j) {
      Matrix du = no_input;
      du(j, k) = 1;
      EXPECT_NEAR(by_tangents.dot(B(none, du)), J.inputs(j, k), 1e-9 * size);
    }
  }
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(by_tangents.dot(B(none, no_input, Vector::Unit(2, k))), J.instants(k), 1e-9 * size);
  }
}

TEST(CostGradient, RefusesWhereThereIsNone) {
  // As the forward derivative does, for its reason.
  const test::ReferenceCase c("rigid_biped_simultaneous");
  const Trajectory run = Simulate(*c.system, c.x, c.u, c.duration);
  const BDerivative B = DifferentiateOutcome(*c.system, run);
  const RunCost cost = Covector(Vector::Ones(c.system->state_size()));
  const CostGradient J = DifferentiateCost(*c.system, run, cost);
  EXPECT_FALSE(B.status.ok());
  EXPECT_EQ(B.status.outcome, J.status.outcome);
  EXPECT_EQ(B.status.message, J.status.message);
  // A kink, whose contacts and instant it names.
  const test::ReferenceCase kink("soft_biped_simultaneous");
  const Trajectory trot = Simulate(*kink.system, kink.x, kink.u, kink.duration);
  const CostGradient none =
      DifferentiateCost(*kink.system, trot, Covector(Vector::Ones(kink.system->state_size())));
  EXPECT_EQ(Outcome::kNotPiecewiseLinear, none.status.outcome);
  EXPECT_NE(none.status.message.find(kink.system->description().constraints[0]), std::string::npos)
      << none.status.message;
  // A running cost with a wrong derivative.
  const auto ball = MakeModel("bouncing_ball");
  Vector x(4);
  x << 0, 0.5, 0.3, 0.2;
  const Trajectory bounce = Simulate(*ball, x, Vector(), 0.6);
  RunCost wrong;
  wrong.running = [](double, const Vector& at, const Vector&, CostRate* rate) {
    rate->value = at(1) * at(1);
    rate->by_state(1) = at(1);  // and not twice that
  };
  const CostGradient withheld = DifferentiateCost(*ball, bounce, wrong);
  EXPECT_EQ(Outcome::kNotDifferentiable, withheld.status.outcome);
  EXPECT_NE(withheld.status.message.find("running cost"), std::string::npos)
      << withheld.status.message;
  // Misuse.
  EXPECT_THROW(DifferentiateCost(*ball, bounce, RunCost()), std::invalid_argument);
  RunDirection w;
  w.initial = Vector::Ones(3);
  EXPECT_THROW(DifferentiateCost(*ball, bounce, wrong, {}, &w), std::invalid_argument);
  QuadraticCost negative;
  negative.weight = -Vector::Ones(4);
  EXPECT_THROW(negative.Make(*ball), std::invalid_argument);
}

/// l may name time: λᵀF + l then changes by ∫ ∂l/∂t. ∫ t z dt of a falling ball, by z(0) and ż(0):
/// T²/2 and T³/3.
TEST(CostGradient, OfACostThatNamesTime) {
  const auto ball = MakeModel("bouncing_ball");
  Vector x(4);
  x << 0, 5, 0, 1;
  const double T = 0.4;
  RunCost cost;
  cost.running = [](double t, const Vector& at, const Vector&, CostRate* rate) {
    rate->value = t * at(1);
    rate->by_state(1) = t;
    rate->by_time = at(1);
  };
  const CostGradient J = DifferentiateCost(*ball, Simulate(*ball, x, Vector(), T), cost);
  ASSERT_TRUE(J.status.ok()) << J.status.message;
  EXPECT_NEAR(T * T / 2, J.initial(1), 1e-13);
  EXPECT_NEAR(T * T * T / 3, J.initial(3), 1e-13);
  EXPECT_NEAR(5 * T * T / 2 + T * T * T / 3 - 9.81 * T * T * T * T / 8, J.cost, 1e-12);
}

/// By the start and every parameter of every model, at its nominal run: what the forward derivative
/// gives along them, in time. A parameter without influence has a zero.
TEST(CostGradient, OfEveryModelIsThatOfTheForwardDerivative) {
  int given = 0, refused = 0, directions = 0;
  for (const std::string& name : ModelNames()) {
    const auto system = MakeModel(name);
    const int d = system->dof(), p = static_cast<int>(system->description().parameters.size());
    std::vector<int> all(static_cast<std::size_t>(p));
    std::iota(all.begin(), all.end(), 0);
    SimulateOptions options;
    options.dense = true;
    options.max_seconds = 10;
    const NominalRun& nominal = system->nominal();
    const Trajectory run =
        Simulate(*system, nominal.x, nominal.u, std::min(nominal.duration, 1.1), options);
    if (!run.status.ok()) continue;
    const BDerivative B = DifferentiateOutcome(*system, run, Options(false, all));
    const Vector covector = Random(system->state_size(), 9);
    const CostGradient J = DifferentiateCost(*system, run, Covector(covector), Options(false, all));
    if (!J.status.ok()) {
      EXPECT_FALSE(B.status.ok() && B.IsDifferentiable()) << name << ": " << J.status.message;
      ++refused;
      continue;
    }
    ++given;
    ASSERT_TRUE(B.status.ok()) << name << ": " << B.status.message;
    const Vector by_tangents = ByTangents(*system, run.FinalState(), covector);
    Vector gradient(2 * d + p);
    gradient << J.initial, J.parameters;
    const double size = 1 + gradient.cwiseAbs().maxCoeff();
    for (int k = 0; k < 2 * d + p; ++k) {
      const Vector w = Vector::Unit(2 * d + p, k);
      if (B.start.Leaves(w) >= 0) continue;  // the start does not admit it
      EXPECT_NEAR(by_tangents.dot(B(w)), gradient(k), 1e-8 * size) << name << ", " << k;
      ++directions;
    }
  }
  EXPECT_GT(given, 8);
  EXPECT_GT(refused, 3);
  EXPECT_GE(directions, 150);
}

}  // namespace
}  // namespace contact_flow
