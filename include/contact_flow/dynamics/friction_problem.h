// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// One contact of a FrictionProblem.
struct FrictionContact {
  double coefficient = 0;  ///< μ, Friction::kNoSlip for none
  int dimension = 0;       ///< tangential rows: 0 without friction, 1 in the plane, 2 in space
  /// Whether it slips already, in this direction (a unit vector; its first entry ±1 in the plane).
  bool slips = false;
  Eigen::Vector2d direction = Eigen::Vector2d::Zero();
};

/// The contact problem with Coulomb friction, for accelerations and for impulses alike:
///   (F4)  y = G λ + b,   0 ≤ λ_n ⟂ y_n ≥ 0,   |λ_t| ≤ μ λ_n,
///         y_t ≠ 0 ⇒ λ_t = −μ λ_n y_t/|y_t|  (of a contact that slips: λ_t = −μ λ_n d).
/// Rows are (normal, tangential) contact by contact.
struct FrictionProblem {
  Matrix G;
  Vector b;
  std::vector<FrictionContact> contacts;
  /// By contact, what its inequalities may miss beside `border`, in units of b: where b itself
  /// vanishes (forces that reach zero) it is no scale. Empty for none.
  Vector slack;
  /// By row, what b is known to. Contacts that feel only each other, and whose b is not known from
  /// zero, take no forces. Empty where b is exact.
  Vector rounding;

  int Row(std::size_t contact) const;  ///< of its normal
};

/// One solution: a letter for each contact, forces, and what they lead to.
struct FrictionSolution {
  std::vector<Letter> letters;
  Vector force;                             ///< λ
  Vector result;                            ///< y
  std::vector<Eigen::Vector2d> directions;  ///< of slip
  double margin = 0;  ///< of the inequality that holds most closely, relative; may be −1e-12
  /// Where the word's rows are dependent, many λ lead to this y. `force` is the admissible one with
  /// the smallest sum of squares, and this the one farthest from the borders; else empty.
  Vector interior;
  /// … or to many y: this is one of them,
  bool many = false;
  /// or the one of equal springs, infinitely stiff, under all contacts: y = (G + ε I) λ + b, ε → 0;
  bool springs = false;  ///< or theirs on a border, where other words were not looked for.
  /// Contacts of one body begin to slip in several directions, from the last share of their forces.
  bool turns = false;
};

/// All solutions, by trying every word: the letters {o, s, +, −} of a contact in the plane, {o, s,
/// l} in space, {o, l} of one that slips or has no friction, {o, s} without slip. Contacts that do
/// not feel each other are decided apart. In the plane every solution is found. In space the
/// directions of contacts that begin to slip are roots of an equation each: of one contact all are
/// found, by sampling the circle; of several coupled ones those that Newton's method finds from a
/// grid of directions. Words that hold with equality are all in the list: a solution on a border
/// has several words, and `border` says how closely an inequality has to hold, in normalized rows
/// and relative to the largest b. Where rows are dependent a word is a solution if some λ is
/// admissible, and of words that differ in what others imply (a corner of a body of which two stick
/// cannot begin to slip) or in contacts without which the motion is the same (a box on a diagonal
/// of its face) only the one that sticks, and is closed, is listed; slips that begin there in space
/// are found if they have one direction, and are not looked for where all sticks with room. Where
/// no word decides the motion, as that of a face that slides and turns, or more than four contacts
/// depend on each other, the solution is that of equal springs, if it is found, beside motions in
/// which contacts rise. Throws std::domain_error beyond kMaxCoupledContacts that feel each other.
std::vector<FrictionSolution> SolveFriction(const FrictionProblem& problem, double border = 1e-11);

/// Contacts of which all words are tried; of more with independent rows words are searched, and
/// `springs` says where others were not looked for.
constexpr int kMaxTriedContacts = 8;
/// Contacts that are decided together.
constexpr int kMaxCoupledContacts = 32;

/// The solution of one word with given directions of slip, whether or not it is admissible; the
/// letters' forces by (F3). Where its rows are dependent the forces farthest from the borders, see
/// FrictionSolution; with `share` false any forces that lead to its y. False where none exist.
bool SolveWord(const FrictionProblem& problem, FrictionSolution* solution, bool share = true);

}  // namespace contact_flow
