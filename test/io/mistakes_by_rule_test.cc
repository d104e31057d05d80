// SPDX-License-Identifier: BSD-3-Clause
// Every key of a robot's YAML misspelt, and every value replaced, one at a time: the answer has the
// line, what is written there, and what may be.
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>
#include <vector>

#include "contact_flow/io/robot_file.h"
#include "contact_flow/io/text_file.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

struct Place {
  std::size_t begin, length;  // in the text
  int line;
};

/// Where a pattern's first group is, outside of comments.
std::vector<Place> Places(const std::string& text, const std::regex& pattern) {
  std::vector<Place> places;
  std::istringstream lines(text);
  std::string line;
  std::size_t begin = 0;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::string code = line.substr(0, line.find('#'));
    for (std::sregex_iterator it(code.begin(), code.end(), pattern), end; it != end; ++it) {
      places.push_back({begin + static_cast<std::size_t>(it->position(1)),
                        static_cast<std::size_t>(it->length(1)), number});
    }
    begin += line.size() + 1;
  }
  return places;
}

class MistakesByRule : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    path_ = RobotFile(GetParam());
    texts_ = ReadRobotTexts(path_);
    robot_ = ParseRobot(texts_);
  }

  /// The refusal of the robot with something else in this place, or "".
  std::string Answer(const Place& place, const std::string& written) {
    RobotTexts texts = texts_;
    texts.yaml.replace(place.begin, place.length, written);
    try {
      MakeRobot(texts, {});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  }

  std::string At(const Place& place) const { return texts_.yaml.substr(place.begin, place.length); }

  /// What a user calls as he likes.
  std::set<std::string> FreeNames() const {
    std::set<std::string> names;
    for (const auto& element : robot_.constraints) names.insert(element->parts.name);
    for (const auto& element : robot_.efforts) names.insert(element->parts.name);
    for (const auto& exposed : robot_.parameters) names.insert(exposed.parameter.name);
    return names;
  }

  void ExpectTold(const Place& place, const std::string& written, const std::string& told) {
    const std::string answer = Answer(place, written);
    const std::string line = "(line " + std::to_string(place.line) + ")";
    const std::string what = At(place) + " -> " + written + " " + line + ": " + answer;
    EXPECT_NE(std::string::npos, answer.find(told)) << what;
    EXPECT_NE(std::string::npos, answer.find(line)) << what;
  }

  std::string path_;
  RobotTexts texts_;
  RobotDescription robot_;
};

TEST_P(MistakesByRule, KeysMisspelt) {
  const std::set<std::string> free = FreeNames();
  int tried = 0;
  for (const Place& place : Places(texts_.yaml, std::regex("(?:^|[ {&])([a-z_]+)(?=:( |$))"))) {
    const std::string key = At(place);
    if (free.count(key) || key.size() < 3) continue;
    std::string written = key;  // its last two letters exchanged, or one left out
    std::swap(written[key.size() - 2], written[key.size() - 1]);
    if (written == key) written.pop_back();
    ExpectTold(place, written, "'" + written + "'");
    ++tried;
  }
  EXPECT_GT(tried, 20);
}

TEST_P(MistakesByRule, NumbersReplaced) {
  int tried = 0;
  for (const Place& place : Places(texts_.yaml, std::regex(": (-?[0-9][-0-9.e]*)(?=[ ,}]|$)"))) {
    for (const char* written : {"'abc'", "'nan'", "'1e999'", "'1,5'", "''"}) {
      ExpectTold(place, written, "is " + std::string(written));
    }
    for (const char* written : {"[1, 2]", "{a: 1}"}) ExpectTold(place, written, written);
    ++tried;
  }
  EXPECT_GT(tried, 8);
}

TEST_P(MistakesByRule, WordsReplaced) {
  int tried = 0;
  for (const Place& place : Places(texts_.yaml, std::regex(": ([a-z_]+)(?=[ ,}]|$)"))) {
    const std::string misspelt = At(place) + "x";
    ExpectTold(place, misspelt, "'" + misspelt + "'");
    ExpectTold(place, "{a: 1}", "{a: 1}");
    ExpectTold(place, "''", "''");
    ++tried;
  }
  EXPECT_GT(tried, 5);
}

INSTANTIATE_TEST_SUITE_P(, MistakesByRule,
                         testing::Values("quadruped_friction", "gripper_friction", "soft_biped",
                                         "planar_biped_friction"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace contact_flow
