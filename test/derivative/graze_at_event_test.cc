// SPDX-License-Identifier: BSD-3-Clause
// A ball grazes at the instant of another body's event, or a little before or after it.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

constexpr double kGraze = 1, kSpan = 1.5;  // [s]

/// A ball is lifted at 1 m/s² over a floor, y = height + (t − 1)²/2. Beside it a body falls onto a
/// table, or is pressed on it, by a force that falls with a clock; it slides there.
struct BallAndBody : test::UnitMasses<4, 2> {
  static constexpr const char* kName = "ball_and_body";
  static constexpr std::array<const char*, 4> kCoordinates = {"y", "x", "z", "clock"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "m", "s"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "table"};
  static constexpr int kInputs = 1;
  static constexpr std::array<const char*, 1> kInputNames = {"push"};
  template <class P>
  struct Parameters {
    P load = 0, fades = 0, restitution = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(load, "load", "N", "on the body, at t = 0", Range::kAny);
      visit(fades, "fades", "N/s", "what it loses", Range::kAny);
      visit(restitution, "restitution", "-", "of the table", Range::kNonNegative);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                    const Eigen::Matrix<S, 4, 1>&, const Eigen::Matrix<S, 1, 1>& u,
                    Eigen::Matrix<S, 4, 1>* f) {
    (*f)(0) = S(1.0);
    (*f)(1) = u(0);
    (*f)(2) = p.fades * q(3) - p.load;
    (*f)(3) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 4, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(0);
    (*a)(1) = q(2);
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return i == 0 ? P(0.5) : p.restitution;
  }
  template <class P>
  static NominalRun Nominal(const P&) {
    return {Vector::Zero(8), Vector::Zero(1)};
  }
};

/// The same with friction on the table.
struct BallAndSlider : BallAndBody {
  static constexpr const char* kName = "ball_and_slider";
  static constexpr int kSlipDimension = 1;
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 4, 1>&,
                   const Eigen::Matrix<S, 4, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = S(0.0) * v(1);
    (*s)(1) = v(1);
  }
  template <class P>
  static P Friction(const Parameters<P>&, int i) {
    return P(i == 0 ? 0.0 : 0.5);
  }
};

/// What happens beside the ball, at t = 1 + apart.
enum class Beside { kLands, kBounces, kIsReleased, kStops, kChangesInput, kEnds };
constexpr Beside kAllBeside[] = {Beside::kLands, Beside::kBounces,      Beside::kIsReleased,
                                 Beside::kStops, Beside::kChangesInput, Beside::kEnds};

struct GrazeCase {
  std::unique_ptr<MechanicalSystem> system;
  Vector x;
  InputSchedule inputs = InputSchedule::Constant(Vector::Zero(1));
  double duration = kSpan;

  GrazeCase(Beside beside, double apart, bool friction, double height = 0) {
    const double at = kGraze + apart;
    x = test::Entries({height + 0.5, 0, 0, 0, -1, 0, 0, 1});
    ParameterValues values = {{"load", 1}};
    if (beside == Beside::kLands || beside == Beside::kBounces) {
      values = {{"load", 2}, {"restitution", beside == Beside::kLands ? 0 : 0.5}};
      x(2) = at * at;
    }
    if (beside == Beside::kIsReleased) values = {{"load", at}, {"fades", 1}};
    if (beside == Beside::kStops) {
      values = {{"load", 1}};
      x(5) = 0.5 * at;
    }
    if (beside == Beside::kChangesInput) {
      inputs = {{0, at}, {Vector::Constant(1, 0.0), Vector::Constant(1, 0.1)}};
    }
    if (beside == Beside::kEnds) duration = at;
    if (friction) {
      system = std::make_unique<ModelSystem<BallAndSlider>>(values);
    } else {
      system = std::make_unique<ModelSystem<BallAndBody>>(values);
    }
  }
  Trajectory Run(const Vector& start) const { return Simulate(*system, start, inputs, duration); }
  Trajectory Run() const { return Run(x); }
};

std::string BesideText(Beside beside, double apart, bool friction) {
  return std::to_string(static_cast<int>(beside)) + (friction ? " with friction, " : ", ") +
         std::to_string(1e9 * apart) + " ns apart";
}

template <class Function>
void ForAllBeside(const Function& test) {
  for (const bool friction : {false, true}) {
    for (const Beside beside : kAllBeside) {
      if (beside == Beside::kStops && !friction) continue;
      for (const double apart :
           {0.0,  1e-16, -1e-16, 1e-15, -1e-15, 1e-12, -1e-12, 1e-10, -1e-10, 1e-9, -1e-9,
            1e-8, -1e-8, 1e-7,   -1e-7, 1e-6,   -1e-6, 1e-5,   -1e-5, 1e-4,   -1e-4}) {
        test(beside, apart, friction);
      }
    }
  }
}

TEST(GrazeAtEvent, HasNoDerivative) {
  ForAllBeside([](Beside beside, double apart, bool friction) {
    const std::string text = BesideText(beside, apart, friction);
    if (beside == Beside::kEnds && apart < -1.1e-5) return;  // it ends before
    const GrazeCase at(beside, apart, friction);
    const Trajectory run = at.Run();
    ASSERT_TRUE(run.status.ok()) << text << ": " << run.status.message;
    const BDerivative B = DifferentiateOutcome(*at.system, run);
    EXPECT_EQ(Outcome::kGrazing, B.status.outcome) << text << ": " << B.status.message;
    EXPECT_NE(std::string::npos, B.status.message.find("'floor'")) << text;
    EXPECT_NE(std::string::npos, B.status.message.find("t = ")) << text;
    if (beside == Beside::kEnds && apart < 1e-7) return;  // nothing happens before
    int grazes = 0;
    for (const Transition& event : run.transitions) {
      if (!event.grazed.Contains(0)) continue;
      ++grazes;
      EXPECT_NEAR(kGraze, event.t, 2e-6) << text;
    }
    EXPECT_EQ(1, grazes) << text;
    long warnings = 0;
    for (const Warning& warning : run.warnings) warnings += warning.code == Outcome::kGrazing;
    EXPECT_EQ(1, warnings) << text;
  });
}

/// Lower by α it touches √(2α) before, at as much speed.
TEST(GrazeAtEvent, OutcomesFollowASquareRoot) {
  ForAllBeside([](Beside beside, double apart, bool friction) {
    const GrazeCase at(beside, apart, friction);
    if (std::abs(apart) > 1e-9) return;
    for (const double alpha : {1e-4, 1e-6}) {
      Vector lower = at.x;
      lower(0) -= alpha;
      const double change = (at.Run(lower).FinalState() - at.Run().FinalState())(4);
      EXPECT_NEAR(1.5 * std::sqrt(2 * alpha), change, 0.02 * change + 1e-7)
          << BesideText(beside, apart, friction);
    }
  });
}

/// One that passes above has one, whatever happens beside it; one that lands has the other.
TEST(GrazeAtEvent, IsNoneAboveOrBelow) {
  ForAllBeside([](Beside beside, double apart, bool friction) {
    for (const double height : {1e-6, 1e-4, -1e-4}) {
      const std::string text =
          BesideText(beside, apart, friction) + ", at " + std::to_string(height);
      const GrazeCase at(beside, apart, friction, height);
      const Trajectory run = at.Run();
      ASSERT_TRUE(run.status.ok()) << text;
      for (const Transition& event : run.transitions) EXPECT_TRUE(event.grazed.Empty()) << text;
      const BDerivative B = DifferentiateOutcome(*at.system, run);
      if (beside == Beside::kEnds) continue;
      ASSERT_TRUE(B.status.ok()) << text << ": " << B.status.message;
      const double known = height > 0 ? 0 : 1.5 / std::sqrt(-2 * height);
      EXPECT_NEAR(-known, B(Vector::Unit(8, 0))(4), 1e-6 + 1e-4 * known) << text;
    }
  });
}

/// The turn may be exactly where a step ends, and inside none, as with 1/26 s.
TEST(GrazeAtEvent, IsSeenBetweenSteps) {
  for (const bool friction : {false, true}) {
    for (const double step : {0.5, 1.0 / 26}) {
      const GrazeCase at(Beside::kEnds, 0.5, friction);
      SimulateOptions options;
      options.max_step = step;
      const Trajectory run = Simulate(*at.system, at.x, at.inputs, at.duration, options);
      ASSERT_EQ(1u, run.transitions.size()) << step;
      EXPECT_EQ(ConstraintSet({0}), run.transitions[0].grazed) << step;
      EXPECT_EQ(Outcome::kGrazing, DifferentiateOutcome(*at.system, run).status.outcome) << step;
    }
  }
}

/// The run begins as near to the graze as gaps are known: no direction leads down.
TEST(GrazeAtEvent, AtTheBeginNoDirectionLeadsDown) {
  for (const double apart : {0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-7, -1e-7}) {
    const GrazeCase at(Beside::kLands, -0.9, false);
    Vector x = at.x;
    x(0) = 0.5 * apart * apart;
    x(4) = apart;
    const Trajectory run = Simulate(*at.system, x, Vector::Zero(1), 1);
    const BDerivative B = DifferentiateOutcome(*at.system, run);
    if (!B.status.ok()) {
      EXPECT_EQ(Outcome::kGrazing, B.status.outcome) << apart << ": " << B.status.message;
      continue;
    }
    EXPECT_THROW(B(-Vector::Unit(8, 0)), std::invalid_argument) << apart;
    EXPECT_NEAR(1, B(Vector::Unit(8, 0))(0), 1e-9) << apart;
  }
}

/// Online runs tell of the same.
TEST(GrazeAtEvent, IsToldOnline) {
  for (const bool friction : {false, true}) {
    const std::shared_ptr<MechanicalSystem> system = GrazeCase(Beside::kLands, 0, friction).system;
    OnlineFlow flow(system, 0, GrazeCase(Beside::kLands, 0, friction).x, Vector::Zero(1), {});
    while (flow.now() < kSpan && flow.status().ok()) flow.AdvanceTo(kSpan);
    ASSERT_EQ(1, flow.num_warnings());
    EXPECT_EQ(Outcome::kGrazing, flow.warnings().front().code);
  }
}

}  // namespace
}  // namespace contact_flow
