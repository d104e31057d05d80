// SPDX-License-Identifier: BSD-3-Clause
// One motion with friction in two systems of units, at loose and tight tolerances, by any method,
// with contacts in another order: one word after the other, one outcome within what each run states
// of its error, and one derivative by state, friction and restitution.
// CONTACT_FLOW_FRICTION_SYSTEMS of each kind from CONTACT_FLOW_FRICTION_SEED on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "test/adversary/rescaled_system.h"
#include "test/environment.h"
#include "test/friction/systems/drawn_contacts.h"
#include "test/friction/systems/tips.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using adversary::RescaledSystem;
using adversary::Units;
using test::FromEnvironment;

double Size(const Vector& x) { return x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0; }

/// Lengths, masses and times by powers of two, coordinates and contacts in any order.
Units DrawUnits(int d, int n, test::Dice* dice) {
  Units units = Units::Same(d, n);
  const auto power = [&](double decades) {
    return std::exp2(std::round(dice->Uniform(-decades, decades) * std::log2(10.0)));
  };
  const double length = power(6);
  units.mass = power(6);
  units.time = power(6);
  units.length *= length;
  units.gap *= length;
  for (int i = d - 1; i > 0; --i) {
    std::swap(units.coordinate[i], units.coordinate[static_cast<int>(dice->Uniform(0, i + 1))]);
  }
  for (int i = n - 1; i > 0; --i) {
    std::swap(units.constraint[i], units.constraint[static_cast<int>(dice->Uniform(0, i + 1))]);
  }
  return units;
}

/// A run, its derivative along w (in units of order 1), and the words on its way.
struct Answer {
  Status run, status;
  Vector end, state_error;  // in units of order 1
  std::string words;
  Trajectory trajectory;
  BDerivative B;
};

Answer Ask(const MechanicalSystem& system, const Units& units, const Vector& x, double duration,
           const SimulateOptions& options) {
  Answer answer;
  answer.trajectory = Simulate(system, units.State(x), Vector::Zero(0), duration * units.time,
                               units.Scale(options));
  answer.run = answer.status = answer.trajectory.status;
  answer.end = units.Back(answer.trajectory.FinalState());
  for (const Arc& arc : answer.trajectory.arcs) {
    const std::string word = arc.mode.Word(system.num_constraints());
    for (std::size_t i = 0; i < units.constraint.size(); ++i) {
      answer.words += word[static_cast<std::size_t>(units.constraint[i])];
    }
    answer.words += " ";
  }
  if (!answer.run.ok()) return answer;
  BDerivativeOptions derivative;
  derivative.variables.parameters.resize(system.description().parameters.size());
  std::iota(derivative.variables.parameters.begin(), derivative.variables.parameters.end(), 0);
  answer.B = DifferentiateOutcome(system, answer.trajectory, derivative);
  answer.status = answer.B.status;
  if (answer.status.ok()) answer.state_error = units.Back(answer.B.trust.state_error);
  return answer;
}

class FrictionInOtherUnits : public testing::TestWithParam<int> {
 protected:
  void Judge(long seed, int rows) {
    const test::DrawnContacts drawn = test::DrawContacts(static_cast<unsigned>(seed), rows);
    if (drawn.size != 1) return;
    test::Dice dice(static_cast<unsigned>(seed) + 5000000);
    const MechanicalSystem& system = *drawn.system;
    const int d = system.dof(), n = system.num_constraints();
    const Units same = Units::Same(d, n), units = DrawUnits(d, n, &dice);
    const RescaledSystem rescaled(system, units);
    SimulateOptions options;
    const double tolerances[] = {1e-6, 1e-8, 1e-9, 1e-10, 1e-11};
    options.relative_tolerance = options.absolute_tolerance =
        tolerances[static_cast<int>(dice.Uniform(0, 5))];
    const IntegrationMethod methods[] = {IntegrationMethod::kExplicit, IntegrationMethod::kImplicit,
                                         IntegrationMethod::kAutomatic};
    options.method = methods[static_cast<int>(dice.Uniform(0, 3))];
    SCOPED_TRACE("seed " + std::to_string(seed) + ", tolerance " +
                 std::to_string(std::log10(options.relative_tolerance)) + ", method " +
                 std::to_string(static_cast<int>(options.method)) + ", length " +
                 std::to_string(std::log10(units.length(0))) + ", mass " +
                 std::to_string(std::log10(units.mass)) + ", time " +
                 std::to_string(std::log10(units.time)));
    Answer fine, plain, other;
    try {
      fine = Ask(system, same, drawn.x, drawn.duration, test::TightOptions(1));
      plain = Ask(system, same, drawn.x, drawn.duration, options);
      other = Ask(rescaled, units, drawn.x, drawn.duration, options);
    } catch (const std::invalid_argument& refused) {
      ++tally_["start refused"];
      return;
    }
    const auto both = [](const Status& a, const Status& b) {
      return std::string(OutcomeName(a.outcome)) + " and " + OutcomeName(b.outcome);
    };
    if (plain.run.outcome != other.run.outcome || plain.status.outcome != other.status.outcome) {
      ++tally_["unlike: " + both(plain.status, other.status)];
      Tell(seed, plain.status.message + " | " + other.status.message);
      return;
    }
    if (!plain.status.ok() || !fine.status.ok()) {
      ++tally_["refused: " + both(plain.status, fine.status)];
      return;
    }
    ++tally_["given"];
    if (plain.words != other.words || fine.words != plain.words) {
      ++tally_["other words"];
      Tell(seed, "words " + fine.words + "| " + plain.words + "| " + other.words);
    }
    const double scale = 1 + Size(fine.end);
    for (const Answer* answer : {&plain, &other}) {
      const std::string which = answer == &plain ? "plain" : "other";
      const double off = Size(answer->end - fine.end);
      const double stated = Size(answer->state_error) + Size(fine.state_error) + 1e-12 * scale;
      ++tally_["states"];
      tally_["states above the estimate"] += off > stated;
      if (off > stated) Tell(seed, which + " off " + std::to_string(off / stated));
      EXPECT_LT(off, 10 * stated) << which << " " << fine.words;
    }
    for (int k = 0; k < 3; ++k) {
      Vector w = dice.Normals(2 * d + 2 * n, 1, 1);
      w.head(2 * d) = ProjectAdmissible(system, drawn.x, fine.B.initial_mode, w.head(2 * d));
      Vector given = w;
      given.head(2 * d) = units.State(w.head(2 * d));
      Vector exact, here, there;
      double error = 0;
      try {
        exact = fine.B(w);
        here = plain.B(w);
        there = units.Back(other.B(given));
        error = Size(plain.B.Error(w)) + Size(units.Back(other.B.Error(given)));
      } catch (const std::logic_error&) {
        ++tally_["direction refused"];
        continue;
      }
      ++tally_["directions"];
      const double size = 1 + Size(exact), allowed = 10 * error + 1e-9 * size;
      EXPECT_LT(Size(here - exact), allowed) << "plain, direction " << k << " " << fine.words;
      EXPECT_LT(Size(there - exact), allowed) << "other, direction " << k << " " << fine.words;
    }
  }

  static void Tell(long seed, const std::string& what) {
    if (std::getenv("CONTACT_FLOW_FRICTION_TELL") != nullptr)
      std::cout << seed << " " << what << "\n";
  }

  std::map<std::string, int> tally_;
};

TEST_P(FrictionInOtherUnits, IsTheSame) {
  const long count = FromEnvironment("CONTACT_FLOW_FRICTION_SYSTEMS", 20);
  const long first = FromEnvironment("CONTACT_FLOW_FRICTION_SEED", 1);
  for (long seed = first; seed < first + count; ++seed) Judge(seed, GetParam());
  for (const auto& [what, times] : tally_) std::cout << times << " " << what << "\n";
  EXPECT_GT(tally_["given"], count / 5);
}

INSTANTIATE_TEST_SUITE_P(Rows, FrictionInOtherUnits, testing::Values(1, 2),
                         [](const testing::TestParamInfo<int>& info) {
                           return info.param == 1 ? "InThePlane" : "InSpace";
                         });

/// Two or three tips, coupled by springs and dampers, each of which lands, stops, or turns about
/// kTogether s after the start, all at once.
constexpr double kTogether = 0.15, kEndOfCluster = 0.25;

struct Together {
  std::unique_ptr<MechanicalSystem> system;
  Vector x;  // empty: none found
};

/// When what contact i does happens first, NaN: never.
double InstantOf(const Trajectory& run, int i) {
  for (const Transition& event : run.transitions) {
    const bool changes = event.mode_before.LetterOf(i) != event.mode_after.LetterOf(i);
    if (!changes && !event.activated.Contains(i)) continue;
    for (const EventInstant& instant : event.instants) {
      if (instant.constraint == i) return event.t + instant.offset;
    }
    return event.t;
  }
  return std::nan("");
}

template <int N>
Together DrawTogether(unsigned seed) {
  test::Dice dice(seed);
  ParameterValues values = {{"stiffness", dice.Uniform(0, 10)}, {"damping", dice.Uniform(0, 3)}};
  Vector x = Vector::Zero(4 * N);
  std::vector<int> knobs;  // by which each is put right
  for (int i = 0; i < N; ++i) {
    const Matrix S = dice.Normals(2, 2, 0.3);
    const Matrix mass =
        std::exp(0.5 * dice.Normal()) * (Matrix::Identity(2, 2) + S * S.transpose());
    for (int k = 0; k < 4; ++k) {
      values["m" + std::to_string((2 * i + k / 2) * 2 * N + 2 * i + k % 2)] = mass(k / 2, k % 2);
    }
    const double mu = dice.Uniform(0.2, 0.8), hold = 9 * mu * mass(1, 1), kind = dice.Uniform(0, 3);
    const double way = dice.Chance(0.5) ? 1 : -1;
    values["mu" + std::to_string(i)] = mu;
    values["f" + std::to_string(2 * i + 1)] = -9 * mass(1, 1);
    const bool lands = kind<1, turns = kind> 2;
    values["f" + std::to_string(2 * i)] = lands   ? 3 * dice.Normal()
                                          : turns ? -way * dice.Uniform(1.3, 2.3) * hold
                                                  : dice.Uniform(-0.5, 0.5) * hold;
    knobs.push_back(lands ? 2 * i + 1 : 2 * N + 2 * i);
    if (lands) x(2 * i + 1) = 0.13;
    x(2 * N + 2 * i) = lands ? dice.Normal() : way * 9 * mu * kTogether * (turns ? 3 : 1);
    if (lands) x(2 * N + 2 * i + 1) = -0.2;
  }
  Together drawn{MakeSystem<test::Tips<N>>(values), Vector()};
  const auto late = [&](const Vector& start) {
    const Trajectory run = Simulate(*drawn.system, start, Vector(0), 0.6, test::Tight());
    return Vector(Vector::NullaryExpr(
        N, [&](Eigen::Index i) { return InstantOf(run, static_cast<int>(i)) - kTogether; }));
  };
  for (int step = 0; step < 12; ++step) {
    const Vector miss = late(x);
    if (!miss.allFinite()) return drawn;
    if (miss.cwiseAbs().maxCoeff() < 1e-12) {
      drawn.x = x;
      return drawn;
    }
    Matrix J(N, N);
    for (int j = 0; j < N; ++j) {
      J.col(j) = (late(x + 1e-6 * Vector::Unit(4 * N, knobs[j])) - miss) / 1e-6;
    }
    const Vector by = J.partialPivLu().solve(miss);
    for (int j = 0; j < N; ++j) x(knobs[j]) -= by(j);
  }
  return drawn;
}

/// The number of pieces, which tell B(w) of any w; −1 where there is no derivative.
template <int N>
int PiecesIn(const MechanicalSystem& system, const Units& units, const Vector& x, unsigned seed) {
  SimulateOptions options = test::Tight();
  options.simultaneity_tolerance = 1e-8;
  const Trajectory run =
      Simulate(system, units.State(x), Vector(0), kEndOfCluster * units.time, units.Scale(options));
  const BDerivative B = DifferentiateOutcome(system, run);
  if (!B.status.ok()) return -1;
  const PiecewiseLinearMap map = B.Pieces();
  test::Dice dice(seed);
  for (int k = 0; k < 60; ++k) {
    Vector w = dice.Normals(4 * N, 1, 1);
    for (int i : B.initial_mode) w(2 * i + 1) = w(2 * N + 2 * i + 1) = 0;
    const Vector y = units.State(w), by = units.Back(B(y));
    EXPECT_LE((units.Back(map(y)) - by).cwiseAbs().maxCoeff(), 1e-6 * by.cwiseAbs().maxCoeff())
        << w.transpose();
  }
  return static_cast<int>(map.pieces().size());
}

template <int N>
void JudgePieces(unsigned seed, int* judged) {
  const Together drawn = DrawTogether<N>(seed);
  if (drawn.x.size() == 0) return;
  SCOPED_TRACE(std::to_string(N) + " tips, seed " + std::to_string(seed));
  const int pieces = PiecesIn<N>(*drawn.system, Units::Same(2 * N, N), drawn.x, seed);
  test::Dice dice(seed + 7000);
  const auto power = [&dice] { return std::exp2(std::round(dice.Uniform(-10, 10))); };
  for (int k = 0; k < 2 && pieces > 0; ++k) {
    Units units = Units::Same(2 * N, N);
    for (double& length : units.length) length = power();
    for (double& gap : units.gap) gap = power();
    units.mass = power();
    units.time = power();
    const int others = PiecesIn<N>(RescaledSystem(*drawn.system, units), units, drawn.x, seed);
    if (others < 0) continue;  // velocities that vanish together have no size in these units
    EXPECT_EQ(pieces, others);
    ++*judged;
  }
}

/// Each coordinate, gap, mass and time in units of its own, up to 1000 times larger or smaller.
TEST(FrictionalClusterInOtherUnits, HasAsManyPieces) {
  int judged = 0;
  for (unsigned seed = 1; seed <= 11; ++seed) {
    JudgePieces<2>(seed, &judged);
    JudgePieces<3>(seed, &judged);
  }
  EXPECT_GT(judged, 20);
}

}  // namespace
}  // namespace contact_flow
