// SPDX-License-Identifier: BSD-3-Clause
// Slips that begin with the run, and directions that reverse them; switches of time at its ends.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "contact_flow/derivative/start_cone.h"
#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {
namespace {

/// Rounding of a product of a gradient with a direction, relative to its terms.
constexpr double kNoise = 1e-9;

}  // namespace

/// The slip to the other side, against friction, if all others go on as they are.
void StartCone::FollowReversal(ContactDynamics* dynamics, const VectorRef& x, ContactMode mode,
                               Contact* contact) const {
  const bool forward = mode.LetterOf(contact->constraint) == Letter::kForward;
  ContactMode other = mode;
  other.Set(contact->constraint, forward ? Letter::kBackward : Letter::kForward);
  TouchingContacts touching;
  touching.slipping = other.Without(dynamics->system().compliant());
  try {
    if (SelectWord(dynamics, x, touching, kNoise) != touching.slipping) return;
  } catch (const FrictionRefusal&) {
    return;
  }
  const Vector before = dynamics->Field(x, other), after = dynamics->Field(x, mode);
  const double back = contact->gap.dot(before);
  const double terms = contact->gap.cwiseAbs().dot(before.cwiseAbs());
  if (back > kNoise * terms) contact->turn = (after - before) / back;
}

bool StartCone::Reverses(int constraint) const {
  for (const Contact& contact : contacts_) {
    if (contact.constraint == constraint && contact.slips) return true;
  }
  return false;
}

StartCone::Contact StartCone::SwitchOf(int constraint, const VectorRef& side) {
  Contact contact;
  contact.constraint = constraint;
  contact.speed = std::numeric_limits<double>::infinity();
  contact.gap = side;
  contact.rate = Vector::Zero(side.size());
  return contact;
}

void StartCone::EndOnSwitch(int constraint, const VectorRef& side) {
  contacts_.push_back(SwitchOf(constraint, side));
}

bool StartCone::IsSwitch(int constraint) const {
  for (const Contact& contact : contacts_) {
    if (contact.constraint == constraint && std::isinf(contact.speed)) return true;
  }
  return false;
}

StartCone::Reversal StartCone::reversal() const {
  for (const Contact& contact : contacts_) {
    if (contact.turn.size() == 0) continue;
    const Eigen::Index size = contact.gap.size();
    return {Matrix::Identity(size, size) + contact.turn * contact.gap.transpose(), contact.gap};
  }
  return {};
}

double StartCone::InnerRadius(const VectorRef& w) const {
  double radius = 0;
  for (const Contact& contact : contacts_) {
    const double change = contact.gap.dot(w);
    const bool reverses = contact.turn.size() > 0 && contact.slip * change < 0;
    if (reverses) radius = std::max(radius, -contact.slip / change);
  }
  return radius;
}

Vector StartCone::Unturned(const VectorRef& w) const {
  Vector tangent = w;
  for (const Contact& contact : contacts_) {
    const bool turns = contact.turn.size() > 0 && contact.slip < 0;
    if (turns) tangent += contact.turn * contact.gap.dot(w);
  }
  return tangent;
}

}  // namespace contact_flow
