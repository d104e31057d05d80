// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/implied_gaps.h"

#include <utility>

#include "contact_flow/dynamics/complementarity.h"
#include "src/dynamics/mode_selection.h"

namespace contact_flow {

void ImpliedGaps::Find(const MechanicalSystem& system, const Vector& x, const VectorRef& u,
                       ConstraintSet rigid, ConstraintSet near, const Vector& gap) {
  shares_.clear();
  members_.clear();
  begin_ = gap;
  if (near.Empty()) return;
  Matrix G;
  Vector unused;
  Delassus(system, x, u, rigid | near, &G, &unused);
  std::vector<int> rows, others, constraints;
  int row = 0;
  for (int i : rigid | near) {
    (rigid.Contains(i) ? rows : others).push_back(row++);
    (rigid.Contains(i) ? members_ : constraints).push_back(i);
  }
  for (std::size_t k = 0; k < others.size(); ++k) {
    Vector share;
    if (Independence(G, rows, others[k], &share) > kDependentRow) continue;
    if (!share.allFinite()) share.setZero();  // members that depend on one another
    shares_.emplace(constraints[k], std::move(share));
  }
}

void ImpliedGaps::Add(ConstraintSet others, const Vector& gap) {
  if (Empty()) begin_ = gap;
  for (int i : others) shares_.emplace(i, Vector::Zero(static_cast<Eigen::Index>(members_.size())));
}

ConstraintSet ImpliedGaps::constraints() const {
  ConstraintSet all;
  for (const auto& [i, share] : shares_) all.Insert(i);
  return all;
}

double ImpliedGaps::Moved(int i, const Vector& gap) const {
  const Vector& share = shares_.at(i);
  double moved = gap(i) - begin_(i);
  for (std::size_t k = 0; k < members_.size(); ++k) {
    moved -= share(static_cast<Eigen::Index>(k)) * (gap(members_[k]) - begin_(members_[k]));
  }
  return moved;
}

}  // namespace contact_flow
