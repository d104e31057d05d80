// SPDX-License-Identifier: BSD-3-Clause
#include "word_ahead.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "frame_words.h"

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
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    FrictionContact& contact = problem.contacts[k];
    const int i = frame.constraints()[k], row = problem.Row(k) + 1;
    contact.slips = touching.slipping.Contains(i) && contact.dimension > 0;
    if (!contact.slips) continue;
    if (contact.dimension == 2) {
      contact.direction = (frame.rows().middleRows<2>(row) * x.tail(d)).normalized();
    } else {
      contact.direction(0) = SlipSign(touching.slipping.LetterOf(i));
    }
  }
  std::optional<WordAhead> found;
  const double scale = problem.b.cwiseAbs().maxCoeff();
  for (FrictionSolution& word : SolveFriction(problem, border)) {
    const ContactMode mode = ModeOfWord(frame, word);
    const auto apart = [&] {
      return (word.result - found->solution.result).cwiseAbs().maxCoeff() / scale;
    };
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
                                       const TouchingContacts& touching, ContactMode along,
                                       double border) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof();
  const Vector field = dynamics->Field(x, along).head(2 * d);
  const double size = (1 + x.cwiseAbs().maxCoeff()) / (1e-300 + field.cwiseAbs().maxCoeff());
  for (const double part : kTimesAhead) {
    const Vector later = system.Perturb(x, part * size * field);
    if (!later.allFinite()) break;
    std::optional<WordAhead> word = OnlyWord(dynamics, later, touching, border);
    if (word) return word;
  }
  return std::nullopt;
}

}  // namespace contact_flow
