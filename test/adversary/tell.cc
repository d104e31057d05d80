// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/tell.h"

#include <sstream>

namespace contact_flow {
namespace adversary {

unsigned long PlaceBits(const Case& c, ConstraintSet set) {
  ConstraintSet places;
  for (int i : set) places.Insert(c.units.constraint[i]);
  return places.bits();
}

std::string Events(const Case& c, const Trajectory& run) {
  std::ostringstream text;
  for (const Transition& t : run.transitions) {
    text << " " << t.t / c.units.time << ":+" << t.activated.bits() << ":"
         << t.mode_before.Members().bits() << ">" << t.mode_after.Members().bits();
  }
  return text.str();
}

std::string Events(const Case& c, const ReferenceRun& run) {
  std::ostringstream text;
  for (const ReferenceEvent& e : run.events) {
    text << " " << e.t << ":+" << PlaceBits(c, e.activated) << ":" << PlaceBits(c, e.before) << ">"
         << PlaceBits(c, e.after);
  }
  return text.str();
}

}  // namespace adversary
}  // namespace contact_flow
