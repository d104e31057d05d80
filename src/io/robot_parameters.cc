// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>

#include "contact_flow/nearest_name.h"
#include "robot_parts.h"

namespace contact_flow {
namespace {

/// The range of a number that must be in both. (Zero, in the unit interval but not positive, is
/// then refused where it is set.)
Range Stricter(Range a, Range b) {
  for (const Range range : {Range::kUnitInterval, Range::kPositive, Range::kNonNegative}) {
    if (a == range || b == range) return range;
  }
  return Range::kAny;
}

}  // namespace

void ReadParameters(const YAML::Node& map, RobotDescription* robot) {
  const std::vector<ExposedNumber> all = ListNumbers(*robot);
  std::vector<std::string> names;
  for (const ExposedNumber& number : all) names.push_back(number.parameter.name);
  MapReader reader(map, "parameters");
  std::map<std::string, std::string> owners;  // of places
  for (const std::string& key : reader.Keys()) {
    const auto refuse = [&](const std::string& why) {
      throw std::invalid_argument("parameters/" + key + why + reader.Line(key));
    };
    std::vector<std::string> places;
    reader.Read(key, &places);
    if (places.empty()) refuse(" names no number");
    ExposedNumber exposed;
    for (const std::string& place : places) {
      const auto it = std::find(names.begin(), names.end(), place);
      if (it == names.end()) refuse(": " + UnknownName("number", place, names));
      if (std::find(it + 1, names.end(), place) != names.end()) {
        refuse(": '" + place + "' is the name of two numbers: call what they are of differently");
      }
      const auto [owner, first] = owners.emplace(place, key);
      if (!first && owner->second == key) refuse(" names '" + place + "' twice");
      if (!first) {
        refuse(": '" + place + "' is a number of parameter '" + owner->second +
               "' already: a number has one parameter");
      }
      const ExposedNumber& found = all[it - names.begin()];
      if (exposed.places.empty()) {
        exposed = found;
        exposed.parameter.name = key;
        continue;
      }
      if (found.parameter.value != exposed.parameter.value) {
        std::ostringstream why;
        why.precision(15);
        why << ": '" << place << "' is " << found.parameter.value
            << ", not equal to the numbers before it, " << exposed.parameter.value;
        refuse(why.str());
      }
      exposed.range = Stricter(exposed.range, found.range);
      exposed.places.push_back(found.places[0]);
    }
    robot->parameters.push_back(exposed);
  }
}

}  // namespace contact_flow
