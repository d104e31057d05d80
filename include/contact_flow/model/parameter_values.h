// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Values of named parameters; those not named keep the model's default.
using ParameterValues = std::map<std::string, double>;

/// Which numbers a parameter may take.
enum class Range {
  kAny,           ///< any finite number
  kPositive,      ///< > 0
  kNonNegative,   ///< ≥ 0
  kUnitInterval,  ///< [0, 1]
};

/// Throws std::invalid_argument, naming model, parameter and value, unless `value` is
/// finite and in range.
void CheckParameter(const std::string& model, const std::string& parameter, double value,
                    Range range);

/// Throws std::invalid_argument for the first key of `values` that is none of `known`,
/// with the nearest.
void CheckParameterNames(const std::string& model, const ParameterValues& values,
                         const std::vector<Parameter>& known);

/// Fills a model's parameter struct from named values and returns the list of all of them.
/// `Parameters::Visit` calls visitor(field, name, unit, meaning, range) for each.
template <class Parameters>
std::vector<Parameter> ReadParameters(const std::string& model, const ParameterValues& values,
                                      Parameters* parameters) {
  std::vector<Parameter> all;
  parameters->Visit(
      [&](double& field, const char* name, const char* unit, const char* meaning, Range range) {
        const auto it = values.find(name);
        if (it != values.end()) field = it->second;
        CheckParameter(model, name, field, range);
        all.push_back({name, unit, meaning, field});
      });
  CheckParameterNames(model, values, all);
  return all;
}

}  // namespace contact_flow
