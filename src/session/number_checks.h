// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

/// Checks of numbers that come from outside. They throw std::invalid_argument with the field and
/// the number, as "state.q[3] is nan, expected a finite number".
namespace contact_flow {

/// Throws unless the number is finite and at most kLargestNumber (io/map_reader.h) in size.
void CheckNumber(const std::string& field, double number);
/// Throws unless smallest ≤ number ≤ largest; NaN is not.
void CheckWithin(const std::string& field, double number, double smallest, double largest);
/// CheckNumber for all of them.
void CheckFinite(const std::string& field, const std::vector<double>& numbers);
/// Finite and not negative.
void CheckWeights(const std::string& field, const std::vector<double>& weights);
/// Throws unless there are `size` numbers, as "state.q has 3 entries, expected 7: body_x, …".
void CheckSize(const std::string& field, std::size_t actual, std::size_t size,
               const std::vector<std::string>& names);
/// Throws "field is number, expected …".
[[noreturn]] void RefuseNumber(const std::string& field, double number,
                               const std::string& expected);

}  // namespace contact_flow
