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
#include "slip_directions.h"
#include "turning_onset.h"

namespace contact_flow {
namespace {

/// Motions that differ by less than this are one, and a slack above this is room, relative.
constexpr double kSameGroupMotion = 1e-8, kRoom = 1e-7;
/// A solution with that much room beside `border` is not near another word's.
constexpr double kManyBorders = 1e4;
/// What inequalities of a solution that springs found may miss, relative.
constexpr double kMissed = 1e-9;
/// With dependent rows, contacts of which all words are tried.
constexpr std::size_t kMaxDependentContacts = 4;

/// The letters that a contact may have.
std::vector<Letter> Alphabet(const FrictionContact& contact) {
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

/// The slack of the tightest inequality, with what it may miss, relative to `scale`.
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

/// Whether `other` is the motion of `word` with less contact, or less that sticks, where `word` has
/// room for it: a box on a diagonal of its face.
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

/// The word in which all that may stick does, where that decides the motion.
std::optional<FrictionSolution> AllStick(const FrictionProblem& problem, double scale) {
  FrictionSolution word;
  for (const FrictionContact& contact : problem.contacts) {
    const std::vector<Letter> letters = Alphabet(contact);
    word.letters.push_back(letters[1]);
    word.directions.push_back(contact.direction);
  }
  if (!SolveWord(problem, &word) || word.many) return std::nullopt;
  word.margin = Margin(problem, word, scale);
  return word;
}

/// The words of a group of contacts that feel each other, one after the other.
class Group {
 public:
  Group(const FrictionProblem& problem, double border)
      : problem_(problem), border_(border), implied_(problem) {
    scale_ = problem.b.cwiseAbs().maxCoeff();
    if (!(scale_ > 0)) scale_ = 1;
    for (const FrictionContact& contact : problem.contacts) alphabet_.push_back(Alphabet(contact));
    const double may_miss = problem.slack.size() > 0 ? problem.slack.maxCoeff() : 0;
    room_ = std::max(kRoom, kManyBorders * border) + 2 * may_miss / scale_;
  }

  std::vector<FrictionSolution> Solve() {
    // Most often one of those without directions to find is shown to be the only one.
    if (!implied_.Any()) {
      if (Search(false)) return {solutions_.back()};
      solutions_.clear();
      if (Search(true)) return {solutions_.back()};
      return solutions_.empty() ? Missed() : solutions_;
    }
    std::vector<FrictionSolution> apart;
    std::optional<FrictionSolution> stuck = AllStick(problem_, scale_);
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
      if (Decided(apart)) return apart;
    } else if (stuck_ && stuck->margin > room_) {
      return {std::move(*stuck)};
    } else if (turning) {
      return {std::move(*stuck), std::move(*turning)};
    }
    std::optional<FrictionSolution> springs = SolveEqualSprings(problem_);
    if (!springs) return apart;
    return {WithoutSprings(std::move(*springs))};
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

  /// Where no start of the search came to a solution, springs may.
  std::vector<FrictionSolution> Missed() const {
    std::optional<FrictionSolution> springs = SolveEqualSprings(problem_);
    if (!springs) return {};
    FrictionSolution found = WithoutSprings(std::move(*springs));
    if (!(found.margin >= -kMissed)) return {};
    return {std::move(found)};
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
    if (!std::all_of(apart.begin(), apart.end(), held)) {
      apart.erase(std::remove_if(apart.begin(), apart.end(), held), apart.end());
    }
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
    found.margin = Margin(problem_, found, scale_);
    found.springs = &found == &springs || !(found.margin > room_);
    return std::move(found);
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
      if (slip.norm() <= kSameGroupMotion * scale_) word.letters[i] = Letter::kStick;
    }
    if (word.letters == springs->letters) return;
    FrictionSolution stuck = word;
    if (!SolveWord(problem_, &stuck) || !Decided({*springs, stuck})) return;
    if (!(Margin(problem_, stuck, scale_) >= -border_)) return;
    springs->letters = implied_.Stuck(word.letters);
  }

  /// Takes what fits. Whether it is the only one.
  bool Offer(FrictionSolution found) {
    found.margin = Margin(problem_, found, scale_);
    if (!(found.margin >= -border_)) return false;
    solutions_.push_back(std::move(found));
    const FrictionSolution& last = solutions_.back();
    return !implied_.Any() && last.margin > room_ && IsOnlySolution(problem_, last);
  }

  const FrictionProblem& problem_;
  const double border_;
  const ImpliedLetters implied_;
  double scale_, room_;
  std::vector<std::vector<Letter>> alphabet_;
  bool stuck_ = false;
  std::vector<FrictionSolution> solutions_;
};

}  // namespace

FrictionSolution WithoutForces(const FrictionProblem& problem, const Vector& result) {
  FrictionSolution none;
  none.letters.assign(problem.contacts.size(), Letter::kOpen);
  none.directions.assign(problem.contacts.size(), Eigen::Vector2d::Zero());
  none.force = Vector::Zero(problem.b.size());
  none.result = result;
  none.margin = std::numeric_limits<double>::infinity();
  return none;
}

std::vector<FrictionSolution> SolveGroup(const FrictionProblem& problem, double border) {
  const std::size_t n = problem.contacts.size();
  if (n > kMaxCoupledContacts) {
    throw std::domain_error(std::to_string(n) +
                            " contacts with friction feel each other: at most " +
                            std::to_string(kMaxCoupledContacts) + " are decided together");
  }
  if (problem.rounding.size() > 0 &&
      (problem.b.cwiseAbs().array() <= problem.rounding.array()).all()) {
    return {WithoutForces(problem, Vector::Zero(problem.b.size()))};
  }
  return Group(problem, border).Solve();
}

}  // namespace contact_flow
