// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/map_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <utility>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

std::string At(const YAML::Mark& mark) {
  return mark.is_null() ? "" : " (line " + std::to_string(mark.line + 1) + ")";
}

std::string KindOf(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return QuoteName(node.Scalar());
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Map:
      return "a map";
    default:
      return "nothing";
  }
}

}  // namespace

MapReader::MapReader(const YAML::Node& map, std::string name) : name_(std::move(name)) {
  if (!map.IsDefined() || map.IsNull()) return;
  line_ = At(map.Mark());
  if (!map.IsMap()) {
    throw std::invalid_argument((name_.empty() ? "the file" : name_) + " is " + KindOf(map) +
                                ", expected a map of names to values" + At(map.Mark()));
  }
  for (const auto& entry : map) {
    if (!entry.first.IsScalar()) {
      throw std::invalid_argument("a key of " + (name_.empty() ? "the file" : name_) +
                                  " is not a name" + At(entry.first.Mark()));
    }
    const std::string key = entry.first.Scalar();
    if (std::find(keys_.begin(), keys_.end(), key) != keys_.end()) {
      throw std::invalid_argument(FullName(key) + " is given twice" + At(entry.first.Mark()));
    }
    keys_.push_back(key);
    values_.push_back(entry.second);
  }
}

std::string MapReader::FullName(const std::string& key) const {
  return name_.empty() ? key : name_ + "/" + key;
}

void MapReader::Fail(const std::string& key, const YAML::Node& node,
                     const std::string& expected) const {
  throw std::invalid_argument(FullName(key) + " is " + KindOf(node) + ", expected " + expected +
                              At(node.Mark()));
}

const YAML::Node* MapReader::Find(const std::string& key) {
  known_.push_back(key);
  const auto it = std::find(keys_.begin(), keys_.end(), key);
  return it == keys_.end() ? nullptr : &values_[it - keys_.begin()];
}

double MapReader::Number(const std::string& key, const YAML::Node& node) const {
  if (!node.IsScalar() || node.Scalar().empty()) Fail(key, node, "a number");
  const std::string& text = node.Scalar();
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  // strtod also takes "nan", "inf" and hexadecimal: of these only decimal, finite
  // numbers are meant.
  const bool decimal = text.find_first_not_of("+-.0123456789eE") == std::string::npos;
  if (*end != '\0' || !decimal) Fail(key, node, "a number");
  if (!std::isfinite(number)) Fail(key, node, "a finite number");
  if (std::abs(number) > kLargestNumber) Fail(key, node, "a number up to 1e100 in size");
  return number;
}

void MapReader::Read(const std::string& key, double* value) {
  if (const YAML::Node* node = Find(key)) *value = Number(key, *node);
}

void MapReader::Read(const std::string& key, double* values, int count) {
  const YAML::Node* node = Find(key);
  if (!node) return;
  if (!node->IsSequence() || node->size() != static_cast<std::size_t>(count)) {
    Fail(key, *node, "a list of " + std::to_string(count) + " numbers");
  }
  for (int k = 0; k < count; ++k) {
    values[k] = Number(key + "[" + std::to_string(k) + "]", (*node)[k]);
  }
}

void MapReader::Read(const std::string& key, std::vector<double>* values) {
  const YAML::Node* node = Find(key);
  if (!node) return;
  if (!node->IsSequence()) Fail(key, *node, "a list of numbers");
  values->clear();
  for (const YAML::Node& entry : *node) {
    values->push_back(Number(key + "[" + std::to_string(values->size()) + "]", entry));
  }
}

void MapReader::ReadBounds(const std::string& key, bool upper, std::vector<double>* bounds) {
  const YAML::Node* node = Find(key);
  if (!node) return;
  if (!node->IsSequence()) Fail(key, *node, "a list of numbers");
  const double infinity = std::numeric_limits<double>::infinity();
  bounds->clear();
  for (const YAML::Node& entry : *node) {
    const bool none = entry.IsScalar() && entry.Scalar() == (upper ? ".inf" : "-.inf");
    const std::string name = key + "[" + std::to_string(bounds->size()) + "]";
    bounds->push_back(none ? (upper ? infinity : -infinity) : Number(name, entry));
  }
}

void MapReader::Read(const std::string& key, std::vector<std::string>* values) {
  const YAML::Node* node = Find(key);
  if (!node) return;
  values->clear();
  if (node->IsScalar()) {
    values->push_back(node->Scalar());
    return;
  }
  if (!node->IsSequence()) Fail(key, *node, "a text or a list of texts");
  for (const YAML::Node& entry : *node) {
    if (!entry.IsScalar()) Fail(key, entry, "a text");
    values->push_back(entry.Scalar());
  }
}

bool MapReader::Has(const std::string& key) const {
  return std::find(keys_.begin(), keys_.end(), key) != keys_.end();
}

void MapReader::Require(const std::string& key) const {
  if (Has(key)) return;
  throw std::invalid_argument((name_.empty() ? "the file" : name_) + ": '" + key + "' is missing" +
                              line_);
}

std::string MapReader::Line(const std::string& key) const {
  const auto it = std::find(keys_.begin(), keys_.end(), key);
  return it == keys_.end() ? line_ : At(values_[it - keys_.begin()].Mark());
}

void MapReader::Read(const std::string& key, long* value, long smallest, long largest) {
  const YAML::Node* node = Find(key);
  if (!node) return;
  const double number = Number(key, *node);
  if (number != std::floor(number) || number < static_cast<double>(smallest) ||
      number > static_cast<double>(largest)) {
    Fail(key, *node,
         "a whole number from " + std::to_string(smallest) + " to " + std::to_string(largest));
  }
  *value = static_cast<long>(number);
}

void MapReader::Read(const std::string& key, std::string* value) {
  const YAML::Node* node = Find(key);
  if (!node) return;
  if (!node->IsScalar()) Fail(key, *node, "a text");
  *value = node->Scalar();
}

void MapReader::Read(const std::string& key, bool* value) {
  const YAML::Node* node = Find(key);
  if (!node) return;
  if (!node->IsScalar() || !YAML::convert<bool>::decode(*node, *value)) {
    Fail(key, *node, "true or false");
  }
}

void MapReader::Read(const std::string& key, const std::vector<std::string>& names, int* index) {
  const YAML::Node* node = Find(key);
  if (!node) return;
  if (!node->IsScalar()) Fail(key, *node, "a name");
  const auto it = std::find(names.begin(), names.end(), node->Scalar());
  if (it == names.end()) {
    throw std::invalid_argument(UnknownName(FullName(key), node->Scalar(), names) +
                                At(node->Mark()));
  }
  *index = static_cast<int>(it - names.begin());
}

YAML::Node MapReader::Child(const std::string& key) {
  const YAML::Node* node = Find(key);
  return node ? *node : YAML::Node();
}

void MapReader::Finish() const {
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (std::find(known_.begin(), known_.end(), keys_[i]) != known_.end()) continue;
    throw std::invalid_argument((name_.empty() ? "" : name_ + ": ") +
                                UnknownName("key", keys_[i], known_) + At(values_[i].Mark()));
  }
}

}  // namespace contact_flow
