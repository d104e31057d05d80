// SPDX-License-Identifier: BSD-3-Clause
#include "number_checks.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "contact_flow/io/map_reader.h"

namespace contact_flow {

void RefuseNumber(const std::string& field, double number, const std::string& expected) {
  std::ostringstream text;
  text << field << " is " << number << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

void CheckNumber(const std::string& field, double number) {
  if (!std::isfinite(number)) RefuseNumber(field, number, "a finite number");
  if (std::abs(number) > kLargestNumber) {
    RefuseNumber(field, number, "a number up to 1e100 in size");
  }
}

void CheckWithin(const std::string& field, double number, double smallest, double largest) {
  if (number >= smallest && number <= largest) return;
  std::ostringstream expected;
  expected << smallest << " to " << largest;
  RefuseNumber(field, number, expected.str());
}

void CheckFinite(const std::string& field, const std::vector<double>& numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    CheckNumber(field + "[" + std::to_string(i) + "]", numbers[i]);
  }
}

void CheckWeights(const std::string& field, const std::vector<double>& weights) {
  CheckFinite(field, weights);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (weights[k] >= 0) continue;
    throw std::invalid_argument(field + "[" + std::to_string(k) + "] is " +
                                std::to_string(weights[k]) + ", expected ≥ 0");
  }
}

void CheckSize(const std::string& field, std::size_t actual, std::size_t size,
               const std::vector<std::string>& names) {
  if (actual == size) return;
  std::string text =
      field + " has " + std::to_string(actual) + " entries, expected " + std::to_string(size);
  for (std::size_t i = 0; i < names.size(); ++i) text += (i ? ", " : ": ") + names[i];
  throw std::invalid_argument(text);
}

}  // namespace contact_flow
