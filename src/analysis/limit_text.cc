// SPDX-License-Identifier: BSD-3-Clause
// What limits a radius of validity, in words.
#include <cmath>
#include <sstream>

#include "contact_flow/analysis/validity_radius.h"

namespace contact_flow {

using Limit = ValidityRadius::Limit;

const char* LimitName(Limit limit) {
  switch (limit) {
    case Limit::kNone:
      return "none";
    case Limit::kEventOrder:
      return "event order";
    case Limit::kStart:
      return "start";
    case Limit::kHorizon:
      return "horizon";
    case Limit::kApproachSpeed:
      return "approach speed";
    case Limit::kReleaseRate:
      return "release rate";
    case Limit::kGap:
      return "gap";
    case Limit::kForce:
      return "force";
    case Limit::kImpulse:
      return "impulse";
    case Limit::kCone:
      return "cone";
    case Limit::kSlip:
      return "slip";
    case Limit::kSlipRate:
      return "slip rate";
    case Limit::kImpulseCone:
      return "impulse cone";
    case Limit::kEffort:
      return "effort";
  }
  return "unknown";
}

std::string Describe(const SystemDescription& description, const ValidityRadius& radius) {
  if (std::isnan(radius.radius)) return "not known where a slip begins in space";
  const std::string name =
      radius.constraint < 0
          ? ""
          : "'" + description.constraints[static_cast<std::size_t>(radius.constraint)] + "'";
  std::ostringstream text;
  switch (radius.limit) {
    case Limit::kNone:
      return "";
    case Limit::kEventOrder:
      text << "the events before and at";
      break;
    case Limit::kStart:
      text << "an event leaves the run at its start,";
      break;
    case Limit::kHorizon:
      text << "an event" << (name.empty() ? "" : " of " + name) << " crosses the horizon,";
      break;
    case Limit::kApproachSpeed:
      text << "the touchdown of " << name << " grazes,";
      break;
    case Limit::kReleaseRate:
      text << "the release of " << name << " grazes, or does not happen,";
      break;
    case Limit::kGap:
      text << "the gap of " << name << " closes,";
      break;
    case Limit::kForce:
      text << "the force of " << name << " vanishes,";
      break;
    case Limit::kImpulse:
      text << "an impact lifts " << name << ", or no longer does,";
      break;
    case Limit::kCone:
      text << "the force of " << name << " reaches its cone,";
      break;
    case Limit::kSlip:
      text << "the slip of " << name << " ends,";
      break;
    case Limit::kSlipRate:
      text << "the slip of " << name << " begins or ends at a rate of zero,";
      break;
    case Limit::kEffort:
      text << "the effort '" << radius.effort << "' reaches its limit, or leaves it,";
      break;
    case Limit::kImpulseCone:
      text << "an impact makes " << name << " slip, or no longer does,";
      break;
  }
  text << " t = " << radius.t << " s";
  if (radius.limit == Limit::kEventOrder) text << " change places";
  return text.str();
}

}  // namespace contact_flow
