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
#include <numeric>
#include <stdexcept>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "test/adversary/rescaled_system.h"
#include "test/environment.h"
#include "test/friction/systems/drawn_contacts.h"

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

}  // namespace
}  // namespace contact_flow
