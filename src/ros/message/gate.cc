// SPDX-License-Identifier: BSD-3-Clause
#include "gate.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "contact_flow/io/map_reader.h"

namespace contact_flow {
namespace ros_interface {
namespace {

bool MayPass(double number) { return std::abs(number) <= kLargestNumber; }

}  // namespace

std::vector<std::string> FieldNames(const char* definition) {
  std::vector<std::string> names;
  std::istringstream lines(definition);
  for (std::string line; std::getline(lines, line);) {
    if (line.compare(0, 4, "====") == 0) break;  // the definitions of its parts follow
    line.resize(std::min(line.find('#'), line.size()));
    std::istringstream words(line);
    std::string type, name;
    if (!(words >> type >> name)) continue;
    const bool constant = line.find('=') != std::string::npos;
    if (!constant) names.push_back(name);
  }
  return names;
}

void Gate::PassNumber(double number) const {
  if (!MayPass(number)) CheckNumber(path_, number);
}

void Gate::PassNumbers(const double* numbers, std::size_t count) const {
  for (std::size_t i = 0; i < count; ++i) {
    if (!MayPass(numbers[i])) CheckNumber(path_ + "[" + std::to_string(i) + "]", numbers[i]);
  }
}

void Gate::PassSize(std::size_t size, std::size_t largest, const char* of) const {
  if (size <= largest) return;
  throw std::invalid_argument(path_ + " has " + std::to_string(size) + " " + of + ", at most " +
                              std::to_string(largest) + " are accepted");
}

}  // namespace ros_interface
}  // namespace contact_flow
