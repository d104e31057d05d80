// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

namespace contact_flow {

/// Where the links and joints of a URDF are, for what is said of them.
class UrdfLines {
 public:
  /// A text that CheckUrdfText has passed.
  explicit UrdfLines(const std::string& text);

  /// A message of one finding a line: behind each that tells no line, that of the first joint or
  /// link that it names, as 'leg' or [leg].
  std::string Told(const std::string& message) const;

 private:
  std::string OfFinding(const std::string& finding) const;

  std::map<std::string, int> links_, joints_;
};

}  // namespace contact_flow
