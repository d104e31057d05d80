// SPDX-License-Identifier: BSD-3-Clause
#include "searched_words.h"

#include <algorithm>
#include <utility>

#include "contact_flow/budget.h"
#include "equal_springs.h"
#include "only_solution.h"
#include "slip_directions.h"
#include "word_margins.h"

namespace contact_flow {
namespace {

/// Words that meet on a border are tried up to this many.
constexpr std::size_t kMostMeeting = 4096;
/// What the word of springs may miss, relative: their forces are known to that.
constexpr double kSpringsMiss = 1e-9;

/// Whether any solution, with whichever letters, is the only one.
bool IsOnlyInAnyWord(const FrictionProblem& problem) {
  FrictionSolution any;
  any.letters.assign(problem.contacts.size(), Letter::kSlip);
  return IsOnlySolution(problem, any);
}

class WordSearch {
 public:
  WordSearch(const FrictionProblem& problem, double border, double room)
      : problem_(problem), border_(border), room_(room) {
    scale_ = problem.b.cwiseAbs().maxCoeff();
    if (!(scale_ > 0)) scale_ = 1;
  }

  std::vector<FrictionSolution> Search(const std::vector<Letter>& before) {
    const std::vector<Letter> open(problem_.contacts.size(), Letter::kOpen);
    for (const std::vector<Letter>& letters : {before, StickingLetters(problem_), open}) {
      std::optional<FrictionSolution> word = SolveLetters(problem_, letters, scale_);
      if (word && Offer(std::move(*word))) return {found_.back()};
    }
    std::optional<FrictionSolution> springs = OfSprings();
    if (springs && Offer(std::move(*springs))) return {found_.back()};
    bool all = IsOnlyInAnyWord(problem_);
    for (std::size_t k = 0, count = found_.size(); k < count; ++k) {
      if (!(found_[k].margin > room_)) all = TryMeeting(found_[k]) && all;
    }
    // One of springs misses more than the others may: it counts where there is no other.
    const auto fits = [&](const FrictionSolution& one) { return one.margin >= -border_; };
    if (std::any_of(found_.begin(), found_.end(), fits)) {
      found_.erase(std::stable_partition(found_.begin(), found_.end(), fits), found_.end());
    }
    for (FrictionSolution& one : found_) one.springs = !all;
    return std::move(found_);
  }

 private:
  /// The word of the springs' solution, with its directions of slip.
  std::optional<FrictionSolution> OfSprings() const {
    std::optional<FrictionSolution> word = SolveEqualSprings(problem_);
    if (!word) return std::nullopt;
    if (!PolishSlips(problem_, &*word) && !SolveWord(problem_, &*word)) return std::nullopt;
    word->margin = Margin(problem_, *word, scale_);
    return word;
  }

  /// Takes what fits and is not known. Whether it is shown to be the only one.
  bool Offer(FrictionSolution word) {
    word.springs = false;
    if (word.many || !(word.margin >= -std::max(border_, kSpringsMiss))) return false;
    const bool known = std::any_of(found_.begin(), found_.end(), [&](const auto& other) {
      return other.letters == word.letters && other.margin >= word.margin;
    });
    if (known) return false;
    found_.push_back(std::move(word));
    return found_.back().margin > room_ && IsOnlySolution(problem_, found_.back());
  }

  /// Letters that contact i may have in a solution near to this one, and their directions of slip.
  std::vector<std::pair<Letter, Eigen::Vector2d>> Near(const FrictionSolution& at,
                                                       std::size_t i) const {
    const FrictionContact& contact = problem_.contacts[i];
    const int row = problem_.Row(i), count = contact.dimension;
    const double gain = problem_.G(row, row), near = room_ * scale_;
    const auto force = at.force.segment(row + 1, count), slip = at.result.segment(row + 1, count);
    std::vector<std::pair<Letter, Eigen::Vector2d>> may;
    for (const Letter letter : AlphabetOf(contact)) {
      Eigen::Vector2d direction = contact.direction;
      bool meets = at.result(row) <= near;
      if (letter == Letter::kOpen) {
        meets = gain * at.force(row) <= near;
      } else if (letter == Letter::kStick) {
        meets = meets && slip.norm() <= near;
      } else if (count > 0 && !contact.slips) {
        const bool pulls = gain * force.norm() > near;
        if (slip.norm() > near) {
          direction.head(count) = slip.normalized();
        } else if (pulls) {
          direction.head(count) = -force.normalized();
        }
        if (count == 1) {
          const double sign = letter == Letter::kForward ? 1 : -1;
          const bool free = slip.norm() <= near && !pulls;
          meets = meets && (free || sign * direction(0) > 0);
          direction = {sign, 0};
        }
        const double held = contact.coefficient * at.force(row) - force.norm();
        meets = meets && gain * held <= near && direction.norm() > 0;
      }
      if (meets) may.emplace_back(letter, direction);
    }
    return may;
  }

  /// Adds the words that meet on the border which a solution lies on. False where not all of them
  /// were tried.
  bool TryMeeting(const FrictionSolution& at) {
    const std::size_t n = problem_.contacts.size();
    std::vector<std::vector<std::pair<Letter, Eigen::Vector2d>>> may(n);
    std::size_t count = 1;
    bool whole = true;
    for (std::size_t i = 0; i < n; ++i) {
      may[i] = Near(at, i);
      if (may[i].empty()) may[i] = {{at.letters[i], at.directions[i]}};
      whole = whole && !IsApex(at, i);
      count *= may[i].size();
      if (count > kMostMeeting) return false;
    }
    std::vector<std::size_t> place(n, 0);
    while (true) {
      AskBudget();
      FrictionSolution word;
      for (std::size_t i = 0; i < n; ++i) {
        word.letters.push_back(may[i][place[i]].first);
        word.directions.push_back(may[i][place[i]].second);
      }
      if (PolishSlips(problem_, &word) || SolveWord(problem_, &word)) {
        word.margin = Margin(problem_, word, scale_);
        if (word.margin >= -border_) Offer(std::move(word));
      }
      std::size_t i = 0;
      while (i < n && ++place[i] == may[i].size()) place[i++] = 0;
      if (i == n) return whole;
    }
  }

  /// Force and slip in space vanish together: slips in all directions meet there.
  bool IsApex(const FrictionSolution& at, std::size_t i) const {
    const FrictionContact& contact = problem_.contacts[i];
    if (contact.dimension < 2 || contact.slips) return false;
    const int row = problem_.Row(i);
    const double near = room_ * scale_;
    return at.result.segment(row, 3).norm() <= near &&
           problem_.G(row, row) * at.force.segment(row, 3).norm() <= near;
  }

  const FrictionProblem& problem_;
  const double border_, room_;
  double scale_;
  std::vector<FrictionSolution> found_;
};

}  // namespace

std::vector<Letter> StickingLetters(const FrictionProblem& problem) {
  std::vector<Letter> letters;
  for (const FrictionContact& contact : problem.contacts) {
    letters.push_back(AlphabetOf(contact)[1]);
  }
  return letters;
}

std::optional<FrictionSolution> SolveLetters(const FrictionProblem& problem,
                                             const std::vector<Letter>& letters, double scale) {
  if (letters.size() != problem.contacts.size()) return std::nullopt;
  FrictionSolution word;
  word.letters = letters;
  for (std::size_t i = 0; i < letters.size(); ++i) {
    const FrictionContact& contact = problem.contacts[i];
    const std::vector<Letter> may = AlphabetOf(contact);
    if (std::find(may.begin(), may.end(), letters[i]) == may.end()) return std::nullopt;
    if (letters[i] == Letter::kSlip && contact.dimension == 2 && !contact.slips) {
      return std::nullopt;
    }
    word.directions.push_back(contact.direction);
    if (letters[i] == Letter::kForward) word.directions[i] = {1, 0};
    if (letters[i] == Letter::kBackward) word.directions[i] = {-1, 0};
  }
  if (!SolveWord(problem, &word)) return std::nullopt;
  word.margin = Margin(problem, word, scale);
  return word;
}

std::vector<FrictionSolution> SearchWords(const FrictionProblem& problem, double border,
                                          double room, const std::vector<Letter>& before) {
  return WordSearch(problem, border, room).Search(before);
}

}  // namespace contact_flow
