// SPDX-License-Identifier: BSD-3-Clause
#include "slip_onset.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "contact_flow/dynamics/guards.h"
#include "src/dynamics/coordinate_reach.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/slips_in_space.h"
#include "src/dynamics/word_ahead.h"

namespace contact_flow {
namespace {

/// Directions that differ by less are one.
constexpr double kSameDirection = 1e-6;
/// Slips that begin with less than this part of what would move without contacts have directions
/// of rounding.
constexpr double kSlow = 1e-7;
/// A look ahead moves the state by this part of its size; changes of accelerations meanwhile that
/// are rounding, relative.
constexpr double kAhead = 1e-6, kNoChange = 1e-9;
/// A direction is turned by so much, to see whether it turns back.
constexpr double kTurnedAside = 1e-4;

}  // namespace

ConstraintSet BeginInSpace(const MechanicalSystem& system, ConstraintSet still, ContactMode word) {
  return SlipsInSpace(system, word) & still;
}

std::map<int, Eigen::Vector2d> HeldDirections(ContactDynamics* dynamics, const Vector& x,
                                              ContactMode mode, ConstraintSet begins) {
  dynamics->Evaluate(x, mode);
  std::map<int, Eigen::Vector2d> directions;
  if (!dynamics->shared().Empty()) return directions;
  for (int i : begins) {
    const auto held = dynamics->force().segment<2>(dynamics->system().friction()[i].row);
    directions[i] = -held.normalized();
  }
  return directions;
}

std::map<int, Eigen::Vector2d> OnsetDirections(ContactDynamics* dynamics, const Vector& x,
                                               const TouchingContacts& touching, ContactMode word,
                                               ConstraintSet begins, double border,
                                               WordConventions* by) {
  const MechanicalSystem& system = dynamics->system();
  const int nq = system.num_positions(), d = system.dof();
  const InverseInertia inertia(system, x.head(nq), x.tail(d), dynamics->u(), ContactMode());
  FrictionFrame frame(system, inertia, touching.still | touching.slipping);
  FrictionProblem& problem = frame.problem();
  problem.b = frame.rows() * inertia.FreeAcceleration() + frame.bias();
  problem.slack = Vector::Zero(static_cast<Eigen::Index>(problem.contacts.size()));
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    FrictionContact& contact = problem.contacts[k];
    const int i = frame.constraints()[k], row = problem.Row(k) + 1;
    if (touching.slack.size() > 0) problem.slack(static_cast<Eigen::Index>(k)) = touching.slack(i);
    contact.slips = touching.slipping.Contains(i) && contact.dimension > 0;
    if (!contact.slips) continue;
    if (contact.dimension == 2) {
      contact.direction = (frame.rows().middleRows<2>(row) * x.tail(d)).normalized();
    } else {
      contact.direction(0) = SlipSign(touching.slipping.LetterOf(i));
    }
  }
  std::map<int, Eigen::Vector2d> directions, smallest;
  bool unique = true;
  double least = std::numeric_limits<double>::infinity();  // forces, as λᵀ A M⁻¹ Aᵀ λ
  double fastest = 0;                                      // acceleration of a slip that begins
  for (const FrictionSolution& found : SolveFriction(problem, border)) {
    bool same = true;
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      const bool free = found.letters[k] != Letter::kOpen && problem.contacts[k].dimension == 0;
      const Letter letter = free ? Letter::kSlip : found.letters[k];
      same = same && letter == word.LetterOf(frame.constraints()[k]);
    }
    if (!same) continue;
    const double forces = found.force.dot(problem.G * found.force);
    const bool smaller = forces < least;
    if (smaller) least = forces;
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      const int i = frame.constraints()[k];
      if (!begins.Contains(i)) continue;
      if (smaller) smallest[i] = found.directions[k];
      const auto [at, fresh] = directions.emplace(i, found.directions[k]);
      unique = unique && (fresh || (at->second - found.directions[k]).norm() < kSameDirection);
      fastest = std::max(fastest, found.result.segment<2>(problem.Row(k) + 1).norm());
    }
  }
  const bool slow = !(fastest > kSlow * problem.b.cwiseAbs().maxCoeff());
  if (!unique || slow) {  // the motion is on a border: directions are those a little later
    if (!unique) directions.clear();
    ContactMode along = word;
    for (int i : begins) along.Set(i, Letter::kStick);
    if (const auto ahead = FindWordAhead(dynamics, x, touching, along, border, true)) {
      unique = unique || ahead->mode == word;
      for (std::size_t k = 0; ahead->mode == word && k < problem.contacts.size(); ++k) {
        const int i = frame.constraints()[k];
        if (begins.Contains(i)) directions[i] = ahead->solution.directions[k];
      }
    }
  }
  if (!unique && by != nullptr) {
    by->smallest = true;
    by->motions = "contacts " + begins.ToString(system.description().constraints) +
                  " begin to slip in space in several directions";
    return smallest;
  }
  if (directions.empty() || !unique) {
    throw FrictionRefusal(FrictionRefusal::Kind::kSlipFromRestInSpace,
                          "contacts " + begins.ToString(system.description().constraints) +
                              " begin to slip in space: their direction is not unique");
  }
  return directions;
}

bool SlipsGoOn(ContactDynamics* dynamics, Vector x, ContactMode mode, ContactMode rest,
               const std::map<int, Eigen::Vector2d>& directions, double speed) {
  const MechanicalSystem& system = dynamics->system();
  const int nq = system.num_positions(), d = system.dof();
  // A state whose slips begin, turned by an angle. A slip this small follows the motion at once:
  // it is given, wherever the state is.
  const auto begun = [&](Vector y, double turned) {
    std::map<int, Eigen::Vector2d> onsets = directions;
    for (auto& [i, onset] : onsets) onset = speed * (Eigen::Rotation2Dd(turned) * onset);
    MakeRest(system, rest, onsets, &y);
    return y;
  };
  const auto accelerations = [&](const Vector& at) {
    dynamics->Evaluate(at, mode);
    ConstraintTerms terms;
    system.Constraints(at.head(nq), at.tail(d), &terms);
    return Vector(terms.jacobian * dynamics->acceleration() + terms.bias);
  };
  x = begun(x, 0);
  const Vector field = dynamics->Field(x, mode).head(2 * d);
  const double ahead = kAhead * TimeToMove(system.space(), x, field);
  const Vector later = system.Perturb(x, ahead * field);
  const Vector now = accelerations(x), change = accelerations(begun(later, 0)) - now;
  const double rounding = kNoChange * now.cwiseAbs().maxCoeff();
  if (directions.size() == 1) {
    const auto& [i, along] = *directions.begin();
    const Eigen::Vector2d across(-along(1), along(0));
    const int row = system.friction()[i].row;
    const Vector all =
        accelerations(begun(x, kTurnedAside)) - accelerations(begun(x, -kTurnedAside));
    const Eigen::Vector2d turn = all.segment<2>(row), changed = change.segment<2>(row);
    if (across.dot(turn) > 0) return false;
    // The direction that it turns to has no acceleration across.
    const double turned = across.dot(turn) < 0 ? across.dot(changed) / across.dot(turn) : 0;
    return !(along.dot(changed) - turned * along.dot(turn) < -rounding);
  }
  return std::all_of(directions.begin(), directions.end(), [&](const auto& slip) {
    return !(slip.second.dot(change.segment<2>(system.friction()[slip.first].row)) < -rounding);
  });
}

}  // namespace contact_flow
