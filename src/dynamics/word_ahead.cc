// SPDX-License-Identifier: BSD-3-Clause
#include "word_ahead.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "coordinate_reach.h"
#include "frame_words.h"
#include "row_units.h"

namespace contact_flow {
namespace {

/// Looks ahead move the state by these parts of its size.
constexpr double kTimesAhead[] = {1e-6, 1e-5, 1e-4, 1e-3};
/// Motions that differ by less than this, relative, are one.
constexpr double kSameMotionAhead = 1e-8;
/// What inequalities of a word may miss, relative: springs that are not infinitely stiff begin to
/// slip too late.
constexpr double kMissedAhead = 1e-9;

/// The only word at x.
std::optional<WordAhead> OnlyWord(ContactDynamics* dynamics, const Vector& x,
                                  const TouchingContacts& touching, double border) {
  const MechanicalSystem& system = dynamics->system();
  const int nq = system.num_positions(), d = system.dof();
  const InverseInertia inertia(system, x.head(nq), x.tail(d), dynamics->u(), ContactMode());
  FrictionFrame frame(system, inertia, touching.still | touching.slipping);
  FrictionProblem& problem = frame.problem();
  problem.b = frame.rows() * inertia.FreeAcceleration() + frame.bias();
  SetSlips(touching, x.tail(d), &frame);
  std::optional<WordAhead> found;
  const RowUnits units(problem);
  const double scale = units.Largest(problem.b);
  for (FrictionSolution& word : SolveFriction(problem, border)) {
    const ContactMode mode = ModeOfWord(frame, word);
    const auto apart = [&] { return units.Largest(word.result - found->solution.result) / scale; };
    const bool fits = !word.many && word.margin >= -kMissedAhead;
    if (!fits || (found && (mode != found->mode || apart() > kSameMotionAhead))) {
      return std::nullopt;
    }
    if (!found) found = WordAhead{mode, std::move(word)};
  }
  return found;
}

}  // namespace

std::optional<WordAhead> FindWordAhead(ContactDynamics* dynamics, const Vector& x,
                                       const TouchingContacts& touching, const ContactMode& along,
                                       double border) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof();
  const Vector field = dynamics->Field(x, along).head(2 * d);
  const double time = TimeToMove(system.space(), x, field);
  for (const double part : kTimesAhead) {
    const Vector later = system.Perturb(x, part * time * field);
    if (!later.allFinite()) break;
    std::optional<WordAhead> word = OnlyWord(dynamics, later, touching, border);
    if (word) return word;
  }
  return std::nullopt;
}

}  // namespace contact_flow
