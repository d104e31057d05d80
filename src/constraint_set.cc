// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/constraint_set.h"

namespace contact_flow {

std::vector<std::string> ConstraintSet::Names(const std::vector<std::string>& constraints) const {
  std::vector<std::string> names;
  for (int i : *this) names.push_back(constraints[i]);
  return names;
}

std::string ConstraintSet::ToString(const std::vector<std::string>& constraints) const {
  std::string text = "{";
  for (int i : *this) text += (text.size() > 1 ? ", " : "") + constraints[i];
  return text + "}";
}

}  // namespace contact_flow
