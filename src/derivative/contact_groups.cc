// SPDX-License-Identifier: BSD-3-Clause
#include "contact_groups.h"

namespace contact_flow {

std::vector<ConstraintSet> Groups(ConstraintSet touching,
                                  const std::function<bool(int, int)>& orthogonal) {
  std::vector<ConstraintSet> groups;
  ConstraintSet left = touching;
  while (!left.Empty()) {
    ConstraintSet group({*left.begin()}), added = group;
    left = left - group;
    while (!added.Empty()) {
      ConstraintSet next;
      for (int i : added) {
        for (int j : left) {
          if (!orthogonal(i, j)) next.Insert(j);
        }
      }
      left = left - next;
      group = group | next;
      added = next;
    }
    groups.push_back(group);
  }
  return groups;
}

bool Harmless(const TouchingFrame& frame, ConstraintSet group,
              const std::function<bool(int, int)>& orthogonal) {
  if (group.Size() < 2) return true;
  for (int i : group) {
    if (frame.Restitution(i) > 0) return false;
    for (int j : group.Without(i)) {
      if (frame.G(frame.Row(i), frame.Row(j)) > 0 && !orthogonal(i, j)) return false;
    }
  }
  return true;
}

}  // namespace contact_flow
