// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/constraint_set.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// The rows of ConstraintTerms, forces λ and impulses p [n+l+r]:
///   [0, n)            normal: row i is that of unilateral constraint i
///   [n, n+l)          bilateral
///   [n+l, n+l+r)      tangential: Friction::dimension rows of each contact, from Friction::row on.
/// Friction comes last: a system without it has the same rows but for these. One object per system,
/// which must outlive it.
class RowLayout {
 public:
  /// Of this system.
  explicit RowLayout(const MechanicalSystem& system)
      : system_(system), n_(system.num_constraints()), l_(system.num_bilateral()) {}

  int normal() const { return n_; }                            ///< n
  int bilateral() const { return l_; }                         ///< l
  int tangential() const { return system_.num_tangential(); }  ///< r
  int size() const { return system_.num_rows(); }              ///< n+l+r
  /// Whether a row is that of a unilateral constraint.
  bool IsNormal(int row) const { return row < n_; }
  /// The row of bilateral constraint k < l.
  int OfBilateral(int k) const { return n_ + k; }

  /// The normal part of a vector [n+l+r], or of the rows of a matrix [n+l+r × ·].
  template <class Rows>
  auto Normal(Rows& rows) const {
    return rows.topRows(n_);
  }
  /// Those of the bilateral constraints.
  template <class Rows>
  auto Bilateral(Rows& rows) const {
    return rows.middleRows(n_, l_);
  }
  /// Those of friction.
  template <class Rows>
  auto Tangential(Rows& rows) const {
    return rows.middleRows(n_ + l_, tangential());
  }

  /// The rows whose gaps are 0 where these contacts are closed: their normal ones, in increasing
  /// order, and all bilateral ones.
  std::vector<int> Closed(const ConstraintSet& contacts) const {
    std::vector<int> rows;
    AddClosed(contacts, &rows);
    return rows;
  }
  /// Adds these.
  void AddClosed(const ConstraintSet& contacts, std::vector<int>* rows) const {
    for (int i : contacts) rows->push_back(i);
    for (int k = 0; k < l_; ++k) rows->push_back(OfBilateral(k));
  }
  /// Adds the tangential rows of a contact; none where it has no friction.
  void AddTangential(int contact, std::vector<int>* rows) const {
    if (system_.friction().empty()) return;
    const Friction& friction = system_.friction()[static_cast<std::size_t>(contact)];
    for (int k = 0; k < friction.dimension; ++k) rows->push_back(friction.row + k);
  }
  /// The same of several.
  void AddTangential(const ConstraintSet& contacts, std::vector<int>* rows) const {
    for (int i : contacts) AddTangential(i, rows);
  }

 private:
  const MechanicalSystem& system_;
  const int n_, l_;
};

}  // namespace contact_flow
