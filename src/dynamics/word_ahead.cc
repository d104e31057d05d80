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
/// A slip goes on that keeps this part of its speed, in its direction.
constexpr double kPartOfSlip = 0.5;

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
                                       double border, bool ends) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof();
  const Vector field = dynamics->Field(x, along).head(2 * d);
  const double time = TimeToMove(system.space(), x, field);
  for (const double part : kTimesAhead) {
    const Vector later = system.Perturb(x, part * time * field);
    if (!later.allFinite()) break;
    std::optional<WordAhead> word = OnlyWord(dynamics, later, touching, border);
    if (word && !(ends && word->mode == along)) return word;
  }
  return std::nullopt;
}

bool SpringsLetGo(ContactDynamics* dynamics, const Vector& x, const ContactMode& mode) {
  const MechanicalSystem& system = dynamics->system();
  const int nq = system.num_positions(), d = system.dof();
  const Vector field = dynamics->Field(x, mode).head(2 * d);
  if (dynamics->springs().Empty()) return false;
  const double ahead = kTimesAhead[0] * TimeToMove(system.space(), x, field);
  const Vector later = system.Perturb(x, ahead * field);
  dynamics->Evaluate(later, mode);
  if (dynamics->acceleration().allFinite()) return false;
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  const Vector now = terms.jacobian * x.tail(d);
  system.Constraints(later.head(nq), later.tail(d), &terms);
  const Vector then = terms.jacobian * later.tail(d);
  for (int i : mode - mode.Sticking()) {
    const Friction& friction = system.friction()[i];
    const auto slip = now.segment(friction.row, friction.dimension);
    const double kept = then.segment(friction.row, friction.dimension).dot(slip);
    if (!(kept >= kPartOfSlip * slip.squaredNorm())) return false;
  }
  return true;
}

}  // namespace contact_flow
