// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/parameter_values.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

constexpr double kSmallest = 1e-100;

const char* Complaint(double value, Range range) {
  if (!std::isfinite(value)) return "must be finite";
  switch (range) {
    case Range::kPositive:
      if (!(value > 0)) return "must be positive";
      return value >= kSmallest ? nullptr : "must be at least 1e-100, for what is divided by it";
    case Range::kNonNegative:
      return value >= 0 ? nullptr : "must not be negative";
    case Range::kUnitInterval:
      return value >= 0 && value <= 1 ? nullptr : "must lie in [0, 1]";
    case Range::kAny:
      break;
  }
  return nullptr;
}

}  // namespace

void CheckParameter(const std::string& model, const std::string& parameter, double value,
                    Range range) {
  const char* complaint = Complaint(value, range);
  if (complaint == nullptr) return;
  std::ostringstream message;
  message << "parameter '" << parameter << "' of model '" << model << "' is " << value << ": it "
          << complaint;
  throw std::invalid_argument(message.str());
}

void CheckParameterNames(const std::string& model, const ParameterValues& values,
                         const std::vector<Parameter>& known) {
  std::vector<std::string> names;
  for (const Parameter& parameter : known) {
    if (std::find(names.begin(), names.end(), parameter.name) != names.end()) {
      throw std::invalid_argument("model '" + model + "' has two parameters '" + parameter.name +
                                  "'");
    }
    names.push_back(parameter.name);
  }
  for (const auto& entry : values) {
    bool found = false;
    for (const std::string& name : names) found = found || name == entry.first;
    if (!found) {
      throw std::invalid_argument("model '" + model +
                                  "': " + UnknownName("parameter", entry.first, names));
    }
  }
}

}  // namespace contact_flow
