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

constexpr std::size_t kRoomOfValue = 60;  // for a list or a map in a message [bytes]

/// A value in one line, as far as there is room; what is deeper is not looked at.
void WriteValue(const YAML::Node& node, std::string* text) {
  if (node.IsScalar()) *text += Cut(node.Scalar(), kRoomOfValue);
  if (node.IsNull()) *text += "~";
  if (!node.IsSequence() && !node.IsMap()) return;
  *text += node.IsMap() ? "{" : "[";
  const char* separator = "";
  for (const auto& entry : node) {
    *text += separator;
    separator = ", ";
    if (text->size() > kRoomOfValue) return;
    if (node.IsMap()) {
      WriteValue(entry.first, text);
      *text += ": ";
      WriteValue(entry.second, text);
    } else {
      WriteValue(entry, text);
    }
  }
  *text += node.IsMap() ? "}" : "]";
}

/// ", not [1, 2]" of a list or a map: what QuoteName is to a scalar.
std::string NotValue(const YAML::Node& node) {
  if (!node.IsSequence() && !node.IsMap()) return "";
  std::string text;
  WriteValue(node, &text);
  return ", not " + text + (text.size() > kRoomOfValue ? "…" : "");
}

/// Whether a key is what follows a decimal comma, as 5 in {radius: 1,5}.
bool IsHalfOfNumber(const std::string& key, const YAML::Node& value) {
  return value.IsNull() && !key.empty() && key.find_first_not_of("0123456789") == std::string::npos;
}

}  // namespace

MapReader::MapReader(const YAML::Node& map, std::string name) : name_(std::move(name)) {
  if (!map.IsDefined() || map.IsNull()) return;
  line_ = At(map.Mark());
  if (!map.IsMap()) {
    throw std::invalid_argument((name_.empty() ? "the file" : name_) + " is " + KindOf(map) +
                                ", expected a map of names to values" + NotValue(map) +
                                At(map.Mark()));
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
    places_.push_back(At(entry.first.Mark()));
    values_.push_back(entry.second);
  }
}

std::string MapReader::FullName(const std::string& key) const {
  return name_.empty() ? key : name_ + "/" + key;
}

void MapReader::Fail(const std::string& key, const YAML::Node& node,
                     const std::string& expected) const {
  throw std::invalid_argument(FullName(key) + " is " + KindOf(node) + ", expected " + expected +
                              NotValue(node) + At(node.Mark()));
}

const YAML::Node* MapReader::Find(const std::string& key) {
  known_.push_back(key);
  const auto it = std::find(keys_.begin(), keys_.end(), key);
  return it == keys_.end() ? nullptr : &values_[it - keys_.begin()];
}

double MapReader::Number(const std::string& key, const YAML::Node& node,
                         const std::string& also) const {
  if (!node.IsScalar() || node.Scalar().empty()) Fail(key, node, "a number" + also);
  const std::string& text = node.Scalar();
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  // strtod also takes "nan", "inf" and hexadecimal: of these only decimal, finite
  // numbers are meant.
  const bool decimal = text.find_first_not_of("+-.0123456789eE") == std::string::npos;
  if (*end != '\0' || !decimal) Fail(key, node, "a number" + also);
  if (!std::isfinite(number)) Fail(key, node, "a finite number");
  if (std::abs(number) > kLargestNumber) Fail(key, node, "a number up to 1e100 in size");
  return number;
}

void MapReader::Read(const std::string& key, double* value) {
  if (const YAML::Node* node = Find(key)) *value = Number(key, *node);
}

void MapReader::Read(const std::string& key, const std::string& word, double meaning,
                     double* value) {
  const YAML::Node* node = Find(key);
  if (!node) return;
  const bool is_word = node->IsScalar() && node->Scalar() == word;
  *value = is_word ? meaning : Number(key, *node, " or " + word);
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
  std::string message = (name_.empty() ? "the file" : name_) + ": '" + key + "' is missing";
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (!IsMisspelt(keys_[i], key, 1)) continue;
    throw std::invalid_argument(message + "; there is " + QuoteName(keys_[i]) + places_[i]);
  }
  throw std::invalid_argument(message + line_);
}

std::string MapReader::Line(const std::string& key) const {
  const auto it = std::find(keys_.begin(), keys_.end(), key);
  return it == keys_.end() ? line_ : places_[it - keys_.begin()];
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
    std::string unknown = UnknownName("key", keys_[i], known_);
    if (IsHalfOfNumber(keys_[i], values_[i])) {
      unknown = "unknown key " + QuoteName(keys_[i]) + ": numbers have a decimal point, no comma";
    }
    throw std::invalid_argument((name_.empty() ? "" : name_ + ": ") + unknown + places_[i]);
  }
}

}  // namespace contact_flow
