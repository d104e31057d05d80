// SPDX-License-Identifier: BSD-3-Clause
// Laws of sets of constraints and of contact modes, held to std::set and std::map.
#include "contact_flow/constraint_set.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <type_traits>
#include <utility>

#include "contact_flow/contact_mode.h"

namespace contact_flow {
namespace {

/// Some words beyond those that a set keeps in place.
constexpr int kMost = 520;
static_assert(kMost < ConstraintSet::kMaxConstraints);

// A mode is a set where one is asked for. A set has no letters: what they are is to be said.
static_assert(std::is_convertible_v<ContactMode, ConstraintSet>);
static_assert(!std::is_convertible_v<ConstraintSet, ContactMode>);
static_assert(std::is_constructible_v<ContactMode, ConstraintSet>);
// Nothing is put into a temporary.
template <class Set>
using Inserts = decltype(std::declval<Set>().Insert(0));
template <class Set, class = void>
constexpr bool kTakes = false;
template <class Set>
constexpr bool kTakes<Set, std::void_t<Inserts<Set>>> = true;
static_assert(kTakes<ContactMode&> && !kTakes<ContactMode>);
static_assert(kTakes<ConstraintSet&> && !kTakes<ConstraintSet>);
static_assert(!std::is_assignable_v<ContactMode&, ConstraintSet>);
static_assert(std::is_same_v<ConstraintSet, decltype(ContactMode() - ContactMode())>);
static_assert(std::is_same_v<ConstraintSet, decltype(ContactMode() & ContactMode())>);
static_assert(std::is_same_v<ConstraintSet, decltype(ContactMode() | ContactMode())>);

template <class A, class B, class = void>
struct Comparable : std::false_type {};
template <class A, class B>
struct Comparable<A, B, std::void_t<decltype(std::declval<A>() == std::declval<B>())>>
    : std::true_type {};
static_assert(Comparable<ConstraintSet, ConstraintSet>() && Comparable<ContactMode, ContactMode>());
static_assert(!Comparable<ContactMode, ConstraintSet>());
static_assert(!Comparable<ConstraintSet, ContactMode>());

using Model = std::set<int>;

std::vector<int> Listed(ConstraintSet set) {
  std::vector<int> members;
  for (int i : set) members.push_back(i);
  return members;
}

std::vector<int> Listed(const Model& set) { return {set.begin(), set.end()}; }

/// Sets of many sizes, the ends of the words among their members.
class RandomSets : public testing::Test {
 protected:
  int Index() {
    constexpr int kEnds[] = {0, 1, 62, 63, 64, 65, 127, 128, 129, 191, 192, 256, kMost - 1};
    if (any_() % 4 == 0) return kEnds[any_() % std::size(kEnds)];
    return static_cast<int>(any_() % kMost);
  }

  void Draw(Model* model, ConstraintSet* set) {
    *model = {};
    *set = {};
    const auto dense = any_() % 3;
    const int count = static_cast<int>(any_() % (dense == 0 ? 2 * kMost : 7));
    for (int k = 0; k < count; ++k) {
      const int i = Index();
      model->insert(i);
      set->Insert(i);
    }
  }

  std::mt19937 any_{7};
};

using ConstraintSetLaws = RandomSets;
using ContactModeLaws = RandomSets;

TEST_F(ConstraintSetLaws, AreThoseOfSets) {
  for (int trial = 0; trial < 2000; ++trial) {
    Model a, b;
    ConstraintSet A, B;
    Draw(&a, &A);
    Draw(&b, &B);
    ASSERT_EQ(Listed(a), Listed(A));
    EXPECT_EQ(static_cast<int>(a.size()), A.Size());
    EXPECT_EQ(a.empty(), A.Empty());
    for (int i = 0; i < kMost; ++i) ASSERT_EQ(a.count(i) > 0, A.Contains(i)) << i;
    Model both = a, common, rest;
    both.insert(b.begin(), b.end());
    for (int i : a) (b.count(i) > 0 ? common : rest).insert(i);
    EXPECT_EQ(Listed(both), Listed(A | B));
    EXPECT_EQ(Listed(common), Listed(A & B));
    EXPECT_EQ(Listed(rest), Listed(A - B));
    EXPECT_EQ(a == b, A == B);
    EXPECT_EQ(a != b, A != B);
    EXPECT_EQ(a != b, (A < B) != (B < A)) << "one of two that differ is the less";
    const int i = Index();
    Model with = a, without = a;
    with.insert(i);
    without.erase(i);
    EXPECT_EQ(Listed(with), Listed(A.With(i)));
    EXPECT_EQ(Listed(without), Listed(A.Without(i)));
    ConstraintSet less = A;
    less.Erase(i);
    EXPECT_EQ(A.Without(i), less);
    EXPECT_EQ(A, ConstraintSet::FromWords(A.words()));
    EXPECT_EQ(A & ConstraintSet::All(64), ConstraintSet::FromBits(A.bits()));
  }
}

TEST_F(ConstraintSetLaws, AnOrderIsTransitive) {
  for (int trial = 0; trial < 2000; ++trial) {
    Model model;
    ConstraintSet a, b, c;
    for (ConstraintSet* set : {&a, &b, &c}) Draw(&model, set);
    if (a < b && b < c) {
      EXPECT_LT(a, c);
    }
  }
}

TEST(ConstraintSet, AllAreTheFirst) {
  for (int n = 0; n <= kMost; ++n) {
    const ConstraintSet all = ConstraintSet::All(n);
    EXPECT_EQ(n, all.Size());
    int next = 0;
    for (int i : all) ASSERT_EQ(next++, i);
  }
}

/// Copies share what is beyond, and iterators look at it: neither sees what happens to the set.
TEST_F(ConstraintSetLaws, ACopyAndALoopAreOfTheSetAsItWas) {
  for (int trial = 0; trial < 300; ++trial) {
    Model model;
    ConstraintSet set;
    Draw(&model, &set);
    const ConstraintSet copy = set;
    std::vector<int> met;
    for (int i : set) {
      met.push_back(i);
      set.Erase(i);
      set.Insert(Index());
    }
    EXPECT_EQ(Listed(model), met);
    EXPECT_EQ(Listed(model), Listed(copy));
  }
}

TEST(ConstraintSet, HoldsTheLastOne) {
  constexpr int kLast = ConstraintSet::kMaxConstraints - 1;
  ConstraintSet set({3, kLast});
  EXPECT_EQ((std::vector<int>{3, kLast}), Listed(set));
  EXPECT_EQ(kLast + 1, ConstraintSet::All(kLast + 1).Size());
  set.Erase(kLast);
  EXPECT_EQ(ConstraintSet({3}), set);
}

TEST(ConstraintSet, IsNamedInTheOrderOfItsMembers) {
  const std::vector<std::string> names = {"heel", "toe", "hand"};
  const ConstraintSet set({2, 0});
  EXPECT_EQ((std::vector<std::string>{"heel", "hand"}), set.Names(names));
  EXPECT_EQ("{heel, hand}", set.ToString(names));
  EXPECT_EQ("{}", ConstraintSet().ToString(names));
  EXPECT_EQ("{heel, hand}", ContactMode(set).ToString(names));
}

constexpr Letter kLetters[] = {Letter::kOpen, Letter::kSlip, Letter::kStick, Letter::kForward,
                               Letter::kBackward};
using Word = std::map<int, Letter>;  // of those in contact

void ExpectWord(const Word& word, ContactMode mode) {
  Model members, sticking, slipping;
  for (const auto& [i, letter] : word) {
    members.insert(i);
    if (letter == Letter::kStick) sticking.insert(i);
    if (letter == Letter::kForward || letter == Letter::kBackward) slipping.insert(i);
  }
  ASSERT_EQ(Listed(members), Listed(mode));
  EXPECT_EQ(Listed(members), Listed(mode.Members()));
  EXPECT_EQ(static_cast<int>(word.size()), mode.Size());
  EXPECT_EQ(word.empty(), mode.Empty());
  EXPECT_EQ(Listed(sticking), Listed(mode.Sticking()));
  EXPECT_EQ(Listed(slipping), Listed(mode.SlippingInPlane()));
  std::string text;
  for (int i = 0; i < kMost; ++i) {
    const Letter letter = word.count(i) > 0 ? word.at(i) : Letter::kOpen;
    ASSERT_EQ(letter, mode.LetterOf(i)) << i;
    ASSERT_EQ(letter != Letter::kOpen, mode.Contains(i)) << i;
    text += static_cast<char>(letter);
  }
  EXPECT_EQ(text, mode.Word(kMost));
  // Equal modes have equal bits: no letters are left of what has gone.
  ContactMode anew;
  for (const auto& [i, letter] : word) anew.Set(i, letter);
  EXPECT_EQ(anew, mode);
  EXPECT_FALSE(anew < mode || mode < anew);
}

TEST_F(ContactModeLaws, AreThoseOfMapsToLetters) {
  for (int trial = 0; trial < 300; ++trial) {
    Word word;
    ContactMode mode;
    for (int step = 0; step < 40; ++step) {
      const int i = Index();
      switch (any_() % 6) {
        case 0:
          mode.Erase(i);
          word.erase(i);
          break;
        case 1:
          mode.Insert(i);
          word.insert({i, Letter::kSlip});  // which keeps the letter that is there
          break;
        default: {
          const Letter letter = kLetters[any_() % std::size(kLetters)];
          mode.Set(i, letter);
          word.erase(i);
          if (letter != Letter::kOpen) word[i] = letter;
        }
      }
    }
    ExpectWord(word, mode);
    const int i = Index();
    Word with = word, without = word, among, gone = word;
    with.insert({i, Letter::kSlip});
    without.erase(i);
    ExpectWord(with, mode.With(i));
    ExpectWord(without, mode.Without(i));
    Model model;
    ConstraintSet set;
    Draw(&model, &set);
    for (int j : model) {
      if (word.count(j) > 0) among[j] = word[j];
      gone.erase(j);
    }
    ExpectWord(among, mode.Among(set));
    ExpectWord(gone, mode.Without(set));
    EXPECT_EQ(mode, mode.Among(set).Union(mode.Without(set)));
    Word slips;
    for (int j : model) slips[j] = Letter::kSlip;
    ExpectWord(slips, ContactMode(set));
    // As a set it has no letters.
    EXPECT_EQ(mode.Members() | set, mode | set);
    EXPECT_EQ(mode.Members() - set, mode - set);
    EXPECT_EQ(mode.Members() & set, set & mode);
  }
}

TEST(ContactMode, TellsLettersApart) {
  for (Letter a : kLetters) {
    for (Letter b : kLetters) {
      ContactMode one, other;
      one.Set(270, a);
      other.Set(270, b);
      EXPECT_EQ(a == b, one == other);
      EXPECT_EQ(a != b, one != other);
      EXPECT_EQ(a != b, (one < other) != (other < one));
    }
  }
}

TEST(ContactMode, OfTwoHasTheLaterLetterUnlessItSlipsFreely) {
  const auto mode = [](Letter letter) {
    ContactMode one;
    one.Set(3, letter);
    return one;
  };
  ContactMode other;
  other.Set(5, Letter::kStick);
  for (Letter first : kLetters) {
    EXPECT_EQ(Letter::kStick, mode(first).Union(other).LetterOf(5));
    EXPECT_EQ(first, mode(first).Union(other).LetterOf(3));
    if (first == Letter::kOpen) continue;
    EXPECT_EQ(first, mode(first).Union(mode(Letter::kSlip)).LetterOf(3));
    for (Letter later : {Letter::kStick, Letter::kForward, Letter::kBackward}) {
      EXPECT_EQ(later, mode(first).Union(mode(later)).LetterOf(3));
    }
  }
}

}  // namespace
}  // namespace contact_flow
