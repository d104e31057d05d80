// SPDX-License-Identifier: BSD-3-Clause
#include "projected_word.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/budget.h"
#include "slip_directions.h"
#include "word_margins.h"

namespace contact_flow {
namespace {

/// Rounds between two looks at the word, each time four times as many.
constexpr int kFirstRounds = 16, kMostRounds = 16384;
/// Forces and slips below this part of the largest are none.
constexpr double kNone = 1e-7;

/// The nearest point of the cone |λ_t| ≤ μ λ_n.
Vector OntoCone(const Vector& force, double coefficient) {
  const double normal = force(0), across = force.tail(force.size() - 1).norm();
  if (across <= coefficient * normal) return force;
  Vector nearest = Vector::Zero(force.size());
  if (coefficient * across <= -normal) return nearest;
  nearest(0) = (normal + coefficient * across) / (1 + coefficient * coefficient);
  nearest.tail(force.size() - 1) = coefficient * nearest(0) / across * force.tail(force.size() - 1);
  return nearest;
}

/// The forces that rounds of projections have come to, from none on.
class Projection {
 public:
  explicit Projection(const FrictionProblem& problem)
      : problem_(problem), force_(Vector::Zero(problem.b.size())) {}

  void Rounds(int count) {
    for (int round = 0; round < count; ++round) {
      for (std::size_t i = 0; i < problem_.contacts.size(); ++i) Project(i);
    }
  }

  FrictionSolution Word() const {
    FrictionSolution word;
    word.force = force_;
    word.result = problem_.G * force_ + problem_.b;
    const double pushed = kNone * force_.cwiseAbs().maxCoeff();
    const double moved = kNone * problem_.b.cwiseAbs().maxCoeff();
    for (std::size_t i = 0; i < problem_.contacts.size(); ++i) {
      const FrictionContact& contact = problem_.contacts[i];
      const int row = problem_.Row(i);
      const Vector slip = word.result.segment(row + 1, contact.dimension);
      word.directions.push_back(contact.direction);
      word.letters.push_back(Letter::kOpen);
      if (!(force_(row) > pushed)) continue;
      if (contact.slips || contact.dimension == 0 || contact.coefficient == 0) {
        word.letters.back() = SlipLetter(contact, contact.direction(0));
      } else if (!(slip.norm() > moved) || std::isinf(contact.coefficient)) {
        word.letters.back() = Letter::kStick;
      } else {
        word.letters.back() = SlipLetter(contact, slip(0));
        word.directions.back().setZero();
        word.directions.back().head(contact.dimension) = slip.normalized();
      }
    }
    return word;
  }

 private:
  static Letter SlipLetter(const FrictionContact& contact, double slip) {
    if (contact.dimension != 1 || !(contact.coefficient > 0)) return Letter::kSlip;
    return slip > 0 ? Letter::kForward : Letter::kBackward;
  }

  void Project(std::size_t i) {
    const FrictionContact& contact = problem_.contacts[i];
    const int row = problem_.Row(i), size = 1 + contact.dimension;
    const auto block = problem_.G.block(row, row, size, size);
    auto force = force_.segment(row, size);
    Vector rate = problem_.G.middleRows(row, size) * force_ + problem_.b.segment(row, size);
    if (contact.slips || contact.dimension == 0 || contact.coefficient == 0) {
      Vector along = Vector::Zero(size);
      along(0) = 1;
      if (contact.slips && contact.dimension > 0) {
        along.tail(contact.dimension) =
            -contact.coefficient * contact.direction.head(contact.dimension);
      }
      const double gain = block.row(0).dot(along);
      if (gain > 0) force = std::max(0.0, force(0) - rate(0) / gain) * along;
      return;
    }
    const bool held = std::isinf(contact.coefficient);
    if (!held) rate(0) += contact.coefficient * rate.tail(contact.dimension).norm();
    const Vector moved = force - rate / block.norm();
    force = held ? moved : OntoCone(moved, contact.coefficient);
    if (held) force(0) = std::max(0.0, force(0));
  }

  const FrictionProblem& problem_;
  Vector force_;
};

}  // namespace

std::optional<FrictionSolution> FindProjectedWord(const FrictionProblem& problem, double missed) {
  const double scale = problem.b.cwiseAbs().maxCoeff();
  Projection projection(problem);
  for (int rounds = kFirstRounds; rounds <= kMostRounds; rounds *= 4) {
    AskBudget();
    projection.Rounds(rounds);
    FrictionSolution word = projection.Word();
    if (!word.force.allFinite()) return std::nullopt;
    if (!PolishSlips(problem, &word)) continue;
    word.margin = Margin(problem, word, scale);
    if (word.margin >= -missed) return word;
  }
  return std::nullopt;
}

}  // namespace contact_flow
