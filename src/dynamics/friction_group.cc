// SPDX-License-Identifier: BSD-3-Clause
#include "friction_group.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"
#include "dependent_words.h"
#include "equal_springs.h"
#include "only_solution.h"
#include "projected_word.h"
#include "searched_words.h"
#include "slip_directions.h"
#include "turning_onset.h"
#include "word_margins.h"

namespace contact_flow {
namespace {

/// A solution with that much room beside `border` is not near another word's.
constexpr double kManyBorders = 1e4;
/// What inequalities of a solution that springs found may miss, relative.
constexpr double kMissed = 1e-9;
/// What rates that springs should hold may keep, relative.
constexpr double kUnmet = 1e-6;
/// With dependent rows, contacts of which all words are tried.
constexpr std::size_t kMaxDependentContacts = 4;
/// … and of more where springs decide nothing, if these are no more.
constexpr double kMostWords = 1000;

/// The words of a group of contacts that feel each other, one after the other.
class Group {
 public:
  Group(const FrictionProblem& problem, double border, const std::vector<Letter>& before)
      : problem_(problem), border_(border), before_(before), implied_(problem) {
    scale_ = problem.b.cwiseAbs().maxCoeff();
    if (!(scale_ > 0)) scale_ = 1;
    for (const FrictionContact& one : problem.contacts) alphabet_.push_back(AlphabetOf(one));
    const double may_miss = problem.slack.size() > 0 ? problem.slack.maxCoeff() : 0;
    room_ = std::max(kRoom, kManyBorders * border) + 2 * may_miss / scale_;
  }

  std::vector<FrictionSolution> Solve() {
    // Most often one of those without directions to find is shown to be the only one.
    if (!implied_.Any()) {
      if (problem_.contacts.size() > kMaxTriedContacts) return Searched();
      if (Search(false)) return {solutions_.back()};
      solutions_.clear();
      if (problem_.contacts.size() > kMaxDependentContacts) {  // slips in space have many starts
        std::vector<FrictionSolution> found = SearchWords(problem_, border_, room_, before_);
        const bool only = found.size() == 1 && !found.front().springs;
        if (only && found.front().margin > room_) return found;
      }
      if (Search(true)) return {solutions_.back()};
      return solutions_.empty() ? Missed() : solutions_;
    }
    std::vector<FrictionSolution> apart;
    std::optional<FrictionSolution> stuck =
        SolveLetters(problem_, StickingLetters(problem_), scale_);
    if (stuck && stuck->many) stuck.reset();
    stuck_ = stuck && stuck->margin > kRoom;  // with room
    std::optional<FrictionSolution> turning;
    if (stuck && !stuck_ && stuck->margin >= -border_) {
      turning = FindTurningOnset(problem_, *stuck, border_);
      if (turning) turning->margin = Margin(problem_, *turning, scale_);
    }
    if (problem_.contacts.size() <= kMaxDependentContacts) {
      Search(true);
      Join();
      apart = Uncovered();
      const bool known = std::any_of(apart.begin(), apart.end(), [&](const auto& one) {
        return turning && one.letters == turning->letters;
      });
      if (turning && !known) apart.push_back(*turning);
      if (Decided(apart) || SeveralMotions(apart)) return apart;
    } else if (stuck_ && stuck->margin > room_) {
      return WithOthers({std::move(*stuck)});
    } else if (turning) {
      return WithOthers({std::move(*stuck), std::move(*turning)});
    }
    std::optional<FrictionSolution> springs = SolveEqualSprings(problem_);
    if (!springs) return WithoutLimit(std::move(apart));
    FrictionSolution found = WithoutSprings(std::move(*springs));
    if (!HasLimit(found)) return WithoutLimit(std::move(apart));
    return WithOthers(WithRigid(std::move(found), apart));
  }

 private:
  /// Tries all words, or those without contacts in space that begin to slip. True where it ends
  /// with one that is shown to be the only one.
  bool Search(bool all) {
    const std::size_t n = problem_.contacts.size();
    std::vector<std::size_t> place(n, 0);
    while (true) {
      AskBudget();
      if (Try(place, all)) return true;
      std::size_t i = 0;
      while (i < n && ++place[i] == alphabet_[i].size()) place[i++] = 0;
      if (i == n) return false;
    }
  }

  /// Where springs decide nothing: the first word that fits with room, of more than were tried.
  std::vector<FrictionSolution> WithoutLimit(std::vector<FrictionSolution> found) {
    double words = 1;
    for (const auto& letters : alphabet_) words *= static_cast<double>(letters.size());
    const bool all = problem_.contacts.size() <= kMaxDependentContacts;
    if (all || words > kMostWords) return found.empty() ? Projected() : found;
    any_ = true;
    if (!Search(true)) return solutions_.empty() ? Projected() : Uncovered();
    solutions_.back().springs = true;
    return WithOthers({solutions_.back()});
  }

  bool Try(const std::vector<std::size_t>& place, bool all) {
    FrictionSolution word;
    std::vector<int> unknown;  // contacts in space that begin to slip
    for (std::size_t i = 0; i < place.size(); ++i) {
      const FrictionContact& contact = problem_.contacts[i];
      word.letters.push_back(alphabet_[i][place[i]]);
      word.directions.push_back(contact.direction);
      if (word.letters[i] == Letter::kForward) word.directions[i] = {1, 0};
      if (word.letters[i] == Letter::kBackward) word.directions[i] = {-1, 0};
      const bool turns = word.letters[i] == Letter::kSlip && contact.dimension == 2;
      if (turns && !contact.slips) unknown.push_back(static_cast<int>(i));
    }
    if (unknown.empty()) {
      const bool implied = implied_.Any() && implied_.Change(word.letters);
      return !implied && SolveWord(problem_, &word) && Offer(std::move(word));
    }
    // The word of what is implied is another one.
    if (!all || (implied_.Any() && (stuck_ || implied_.Change(word.letters)))) return false;
    const bool common = implied_.Any() && implied_.Dependent(word.letters);
    for (FrictionSolution& found : common ? FindCommonSlip(problem_, word, unknown)
                                          : FindSlipDirections(problem_, word, unknown)) {
      if (Offer(std::move(found))) return true;
    }
    return false;
  }

  /// More contacts than all words are tried of.
  std::vector<FrictionSolution> Searched() const {
    std::vector<FrictionSolution> found = SearchWords(problem_, border_, room_, before_);
    return found.empty() || !found.front().springs ? found : WithOthers(std::move(found));
  }

  /// Where no start of the search came to a solution, springs may, or projections.
  std::vector<FrictionSolution> Missed() const {
    if (std::optional<FrictionSolution> springs = SolveEqualSprings(problem_)) {
      FrictionSolution word = *springs;
      const bool polished = PolishSlips(problem_, &word) && !word.many;
      if (polished && Margin(problem_, word, scale_) >= -kMissed) *springs = std::move(word);
      FrictionSolution found = WithoutSprings(std::move(*springs));
      if (found.margin >= -kMissed && HasLimit(found)) return {std::move(found)};
    }
    return Projected();
  }

  /// Without room other words may meet there, which are not looked for.
  std::vector<FrictionSolution> Projected() const {
    std::optional<FrictionSolution> found = FindProjectedWord(problem_, kMissed);
    if (!found) return {};
    found->springs = !(found->margin > room_);
    return {std::move(*found)};
  }

  /// Adds what two words of one motion have in common: shares of an edge that sticks, which meet
  /// the cone of one or of the other end, beside an edge whose ends begin to slip two ways.
  void Join() {
    const std::size_t count = solutions_.size();
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        if (solutions_[a].many || !Decided({solutions_[a], solutions_[b]})) continue;
        FrictionSolution word = solutions_[a];
        for (std::size_t i = 0; i < word.letters.size(); ++i) {
          const Letter other = solutions_[b].letters[i];
          if (other != Letter::kStick && word.letters[i] != Letter::kOpen) continue;
          word.letters[i] = other;
          word.directions[i] = solutions_[b].directions[i];
        }
        const bool known =
            std::any_of(solutions_.begin(), solutions_.end(),
                        [&](const FrictionSolution& one) { return one.letters == word.letters; });
        if (known || !SolveWord(problem_, &word)) continue;
        word.margin = Margin(problem_, word, scale_);
        if (!(word.margin >= -border_) || !Decided({solutions_[a], word})) continue;
        solutions_.push_back(std::move(word));
      }
    }
  }

  /// Solutions that are not another one's motion with less contact, or with slips that are held.
  std::vector<FrictionSolution> Uncovered() const {
    std::vector<FrictionSolution> apart;
    for (const FrictionSolution& one : solutions_) {
      const bool covered = std::any_of(
          solutions_.begin(), solutions_.end(),
          [&](const FrictionSolution& word) { return Covers(problem_, word, one, scale_); });
      if (!covered) apart.push_back(one);
    }
    const auto held = [&](const FrictionSolution& one) { return !SlipsMayBegin(problem_, one); };
    if (std::all_of(apart.begin(), apart.end(), held)) return apart;
    apart.erase(std::remove_if(apart.begin(), apart.end(), held), apart.end());
    return apart;
  }

  /// Whether all are one motion, and shares of forces do not decide it.
  bool Decided(const std::vector<FrictionSolution>& all) const {
    for (const FrictionSolution& one : all) {
      const double apart = (one.result - all.front().result).cwiseAbs().maxCoeff();
      if (one.many || !(apart <= kSameGroupMotion * scale_)) return false;
    }
    return !all.empty();
  }

  /// Whether these are motions of their own, none of which shares of forces decide.
  bool SeveralMotions(const std::vector<FrictionSolution>& all) const {
    bool several = false;
    for (const FrictionSolution& one : all) {
      if (one.many) return false;
      several = several || Apart(one, all.front());
    }
    return several;
  }

  bool Apart(const FrictionSolution& one, const FrictionSolution& other) const {
    return !((one.result - other.result).cwiseAbs().maxCoeff() <= room_ * scale_);
  }

  /// What springs came to, and the motions beside it that words decide, in which contacts rise that
  /// press where forces are shared. Where words of shared forces fit beside it springs decided.
  std::vector<FrictionSolution> WithRigid(FrictionSolution springs,
                                          const std::vector<FrictionSolution>& words) const {
    std::vector<FrictionSolution> all = {std::move(springs)};
    for (const FrictionSolution& one : words) {
      if (!(one.margin > room_)) continue;
      if (one.many) all.front().springs = true;
      const bool beside = std::all_of(words.begin(), words.end(), [&](const auto& word) {
        return !word.many || RisesBeside(problem_, one, word, scale_);
      });
      if (one.many || !beside || !RisesBeside(problem_, one, all.front(), scale_)) continue;
      all.push_back(one);
    }
    return all;
  }

  /// Where not all words are tried: with those of all open, and of the letters until now, that fit
  /// with room and are other motions.
  std::vector<FrictionSolution> WithOthers(std::vector<FrictionSolution> found) const {
    if (problem_.contacts.size() <= kMaxDependentContacts) return found;
    const std::vector<Letter> open(problem_.contacts.size(), Letter::kOpen);
    for (const std::vector<Letter>& letters : {open, before_}) {
      std::optional<FrictionSolution> word = SolveLetters(problem_, letters, scale_);
      if (!word || word->many || !(word->margin > room_)) continue;
      const bool known = std::any_of(found.begin(), found.end(),
                                     [&](const auto& one) { return !Apart(*word, one); });
      if (!known) found.push_back(std::move(*word));
    }
    return found;
  }

  /// The same motion by its word alone, where that decides it. Without room other words may meet
  /// there, which are not looked for: then it counts as one of springs.
  FrictionSolution WithoutSprings(FrictionSolution springs) const {
    if (implied_.Any()) {
      springs.letters = implied_.Stuck(springs.letters);
      StickUnmoved(&springs);
    }
    FrictionSolution word = springs;
    const bool decides = SolveWord(problem_, &word) && !word.many;
    FrictionSolution& found = decides && Decided({springs, word}) ? word : springs;
    if (&found == &springs) SolveStiffSprings(problem_, &springs);
    found.margin = Margin(problem_, found, scale_);
    found.springs = &found == &springs || !(found.margin > room_);
    return std::move(found);
  }

  /// Whether contacts that push stay closed, and those that stick do not slide: where bodies jam
  /// springs have no limit, however stiff they are.
  bool HasLimit(const FrictionSolution& found) const {
    double left = 0;
    for (std::size_t i = 0; i < found.letters.size(); ++i) {
      if (found.letters[i] == Letter::kOpen) continue;
      const bool sticks = found.letters[i] == Letter::kStick;
      const int rows = sticks ? 1 + problem_.contacts[i].dimension : 1;
      left = std::max(left, found.result.segment(problem_.Row(i), rows).lpNorm<Eigen::Infinity>());
    }
    return left <= kUnmet * scale_;
  }

  /// Springs creep where the share of a contact reaches its cone although the bodies hold it: a
  /// corner of an edge that sticks. What does not begin to slip sticks where a share exists.
  void StickUnmoved(FrictionSolution* springs) const {
    FrictionSolution word = *springs;
    for (std::size_t i = 0; i < word.letters.size(); ++i) {
      const FrictionContact& contact = problem_.contacts[i];
      const bool begins = Slips(word.letters[i]) && contact.dimension > 0 && !contact.slips;
      if (!begins || !(contact.coefficient > 0)) continue;
      const auto slip = word.result.segment(problem_.Row(i) + 1, contact.dimension);
      if (slip.norm() <= kUnmet * scale_) word.letters[i] = Letter::kStick;
    }
    if (word.letters == springs->letters) return;
    FrictionSolution stuck = word;
    if (!SolveWord(problem_, &stuck) || !(stuck.many || Decided({*springs, stuck}))) return;
    if (!(Margin(problem_, stuck, scale_) >= -border_)) return;
    springs->letters = implied_.Stuck(word.letters);
  }

  /// Takes what fits. Whether it is the only one, or the first that was asked for.
  bool Offer(FrictionSolution found) {
    found.margin = Margin(problem_, found, scale_);
    if (!(found.margin >= -border_)) return false;
    solutions_.push_back(std::move(found));
    const FrictionSolution& last = solutions_.back();
    return last.margin > room_ && (any_ || (!implied_.Any() && IsOnlySolution(problem_, last)));
  }

  const FrictionProblem& problem_;
  const double border_;
  const std::vector<Letter>& before_;
  const ImpliedLetters implied_;
  double scale_, room_;
  std::vector<std::vector<Letter>> alphabet_;
  bool stuck_ = false, any_ = false;
  std::vector<FrictionSolution> solutions_;
};

}  // namespace

std::vector<FrictionSolution> SolveGroup(const FrictionProblem& problem, double border,
                                         const std::vector<Letter>& before) {
  const std::size_t n = problem.contacts.size();
  if (n > kMaxCoupledContacts) {
    throw std::domain_error(
        std::to_string(n) + " contacts with friction feel each other at once, at most " +
        std::to_string(kMaxCoupledContacts) +
        " are decided together: give the bodies fewer points (`vertices: 4` of `contacts`)");
  }
  if (problem.rounding.size() > 0 &&
      (problem.b.cwiseAbs().array() <= problem.rounding.array()).all()) {
    return {WithoutForces(problem, Vector::Zero(problem.b.size()))};
  }
  return Group(problem, border, before).Solve();
}

}  // namespace contact_flow
