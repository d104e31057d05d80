// SPDX-License-Identifier: BSD-3-Clause
#include "word_margins.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

/// The slack of contact i alone, relative.
double SlackOf(const FrictionProblem& problem, const FrictionSolution& s, std::size_t i) {
  const FrictionContact& contact = problem.contacts[i];
  const int row = problem.Row(i);
  const Vector& share = s.interior.size() > 0 ? s.interior : s.force;
  const bool cone = s.letters[i] == Letter::kStick && std::isfinite(contact.coefficient);
  const double slack =
      cone ? contact.coefficient * share(row) - share.segment(row + 1, contact.dimension).norm()
           : share(row);
  return problem.G(row, row) * slack;
}

}  // namespace

std::vector<Letter> AlphabetOf(const FrictionContact& contact) {
  if (contact.dimension == 0 || (contact.slips && contact.dimension == 2)) {
    return {Letter::kOpen, Letter::kSlip};
  }
  if (contact.slips) {
    return {Letter::kOpen, contact.direction(0) > 0 ? Letter::kForward : Letter::kBackward};
  }
  if (std::isinf(contact.coefficient)) return {Letter::kOpen, Letter::kStick};
  if (contact.dimension == 1) {
    return {Letter::kOpen, Letter::kStick, Letter::kForward, Letter::kBackward};
  }
  return {Letter::kOpen, Letter::kStick, Letter::kSlip};
}

bool Slips(Letter letter) { return letter != Letter::kOpen && letter != Letter::kStick; }

FrictionSolution WithoutForces(const FrictionProblem& problem, const Vector& result) {
  FrictionSolution none;
  none.letters.assign(problem.contacts.size(), Letter::kOpen);
  none.directions.assign(problem.contacts.size(), Eigen::Vector2d::Zero());
  none.force = Vector::Zero(problem.b.size());
  none.result = result;
  none.margin = std::numeric_limits<double>::infinity();
  return none;
}

double Margin(const FrictionProblem& problem, const FrictionSolution& s, double scale) {
  double margin = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const FrictionContact& contact = problem.contacts[i];
    const int row = problem.Row(i);
    const double gain = problem.G(row, row);
    const Vector& share = s.interior.size() > 0 ? s.interior : s.force;
    const auto force = share.segment(row + 1, contact.dimension);
    const auto slip = s.result.segment(row + 1, contact.dimension);
    const double may_miss = problem.slack.size() > 0 ? problem.slack(static_cast<int>(i)) : 0;
    if (s.letters[i] == Letter::kOpen) {
      margin = std::min(margin, s.result(row) + may_miss);
      continue;
    }
    const bool cone = s.letters[i] == Letter::kStick && std::isfinite(contact.coefficient);
    // The apex of the cone: both vanish together.
    const double pushes = cone ? contact.coefficient * share(row) - force.norm() : share(row);
    margin = std::min(margin, gain * pushes + may_miss);
    if (Slips(s.letters[i]) && contact.dimension > 0 && !contact.slips) {
      margin = std::min(margin, s.directions[i].head(contact.dimension).dot(slip) + may_miss);
    }
  }
  return margin / scale;
}

bool Covers(const FrictionProblem& problem, const FrictionSolution& word,
            const FrictionSolution& other, double scale) {
  if (word.many || word.letters == other.letters) return false;
  if ((word.result - other.result).cwiseAbs().maxCoeff() > kSameGroupMotion * scale) return false;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    if (word.letters[i] == other.letters[i]) continue;
    const bool less = word.letters[i] == Letter::kStick || other.letters[i] == Letter::kOpen;
    if (!less || word.letters[i] == Letter::kOpen) return false;
    if (!(SlackOf(problem, word, i) > kRoom * scale)) return false;
  }
  return true;
}

bool RisesBeside(const FrictionProblem& problem, const FrictionSolution& one,
                 const FrictionSolution& other, double scale) {
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const bool rises = one.letters[i] == Letter::kOpen && other.letters[i] != Letter::kOpen;
    if (rises && one.result(problem.Row(i)) > kRoom * scale) return true;
  }
  return false;
}

}  // namespace contact_flow
