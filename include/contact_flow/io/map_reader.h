// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <set>
#include <string>
#include <vector>

namespace contact_flow {

/// Larger numbers are taken from nobody: products of three stay finite.
inline constexpr double kLargestNumber = 1e100;

/// Reads a YAML map of which every key must be known: ask for each key once, then call Finish.
/// A key that is absent leaves the output as it was. Numbers may be written as YAML allows and also
/// as 1e-10, which some YAML loaders hand on as a string. Everything else throws
/// std::invalid_argument with the full name of the key, the value and, for a file, the line.
class MapReader {
 public:
  /// `name` is what messages call the map, as "options"; "" for the top level. Null reads as empty.
  MapReader(const YAML::Node& map, std::string name);

  /// A number.
  void Read(const std::string& key, double* value);
  /// A number, or a word that stands for the number `meaning`.
  void Read(const std::string& key, const std::string& word, double meaning, double* value);
  /// Whole numbers in [smallest, largest].
  void Read(const std::string& key, long* value, long smallest, long largest);
  /// A list of `count` numbers.
  void Read(const std::string& key, double* values, int count);
  /// A list of numbers.
  void Read(const std::string& key, std::vector<double>* values);
  /// A list of bounds: numbers, or where there is none .inf of upper ones, -.inf of lower ones.
  void ReadBounds(const std::string& key, bool upper, std::vector<double>* bounds);
  /// A list of texts, or one text alone.
  void Read(const std::string& key, std::vector<std::string>* values);
  /// A text.
  void Read(const std::string& key, std::string* value);
  void Read(const std::string& key, bool* value);  ///< true or false.
  /// One of `names`; the answer is its index.
  void Read(const std::string& key, const std::vector<std::string>& names, int* index);
  /// The value of a key that is itself a map; null when absent.
  YAML::Node Child(const std::string& key);
  /// Whether the map has the key.
  bool Has(const std::string& key) const;
  /// Throws unless the key is there, with the one that is written in its place, if any.
  void Require(const std::string& key) const;
  /// " (line 7)" of a key, or of the map.
  std::string Line(const std::string& key) const;
  /// Every key there is, in the order of the file: for maps whose names are judged elsewhere.
  std::vector<std::string> Keys() const { return keys_; }

  /// Throws for the first key that nobody asked for, with the nearest one that would
  /// have been valid.
  void Finish() const;

 private:
  const YAML::Node* Find(const std::string& key);
  std::string FullName(const std::string& key) const;
  [[noreturn]] void Fail(const std::string& key, const YAML::Node& node,
                         const std::string& expected) const;
  double Number(const std::string& key, const YAML::Node& node, const std::string& also = "") const;

  std::string name_;
  std::string line_;
  std::vector<std::string> keys_;
  std::vector<std::string> places_;  // " (line 7)", of each
  std::vector<YAML::Node> values_;
  std::vector<std::string> known_;
};

}  // namespace contact_flow
