// SPDX-License-Identifier: BSD-3-Clause
// Prints a robot as a YAML to edit: from a URDF (or xacro) alone, or from a robot's YAML.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <stdexcept>
#include <utility>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_summary.h"
#include "contact_flow/io/text_file.h"
#include "contact_flow/model/rigid_body/urdf_loader.h"

namespace contact_flow {
namespace {

const char kUsage[] =
    "usage: describe_robot FILE [--base fixed|planar|floating] [--contacts feet|all|none|LINK,…]\n"
    "                      [--vertices N] [--strict]\n"
    "FILE is a URDF or xacro, or the YAML of a robot; the answer is a YAML for a person to edit.\n";

bool EndsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

int Run(int count, char** words) {
  std::string file, base = "floating", contacts, vertices;
  bool strict = false;
  for (int k = 1; k < count; ++k) {
    const std::string word = words[k];
    const bool more = k + 1 < count;
    if (word == "--base" && more) {
      base = words[++k];
    } else if (word == "--contacts" && more) {
      contacts = words[++k];
    } else if (word == "--vertices" && more) {
      vertices = words[++k];
    } else if (word == "--strict") {
      strict = true;
    } else if (file.empty() && word.compare(0, 2, "--") != 0) {
      file = word;
    } else {
      std::cerr << kUsage;
      return 2;
    }
  }
  if (file.empty()) {
    std::cerr << kUsage;
    return 2;
  }
  RobotTexts texts;
  std::string urdf_path;
  YAML::Node document(YAML::NodeType::Map);
  if (EndsWith(file, ".yaml") || EndsWith(file, ".yml")) {
    texts = ReadRobotTexts(file);
    document = ParseYamlDocument(ReadTextFile(file, kMaxRobotYamlBytes));
    if (document["urdf"]) urdf_path = document["urdf"].as<std::string>();
  } else {
    texts = ReadUrdf(file);
    document["base"] = base;
    urdf_path = file.substr(file.rfind('/') + 1);
  }
  if (strict) document["urdf_faults"] = "strict";
  if (!contacts.empty()) {
    YAML::Node ground;
    std::string name;
    for (const char letter : contacts + ",") {
      if (letter != ',') {
        name += letter;
      } else if (!name.empty()) {
        ground.push_back(name);
        name.clear();
      }
    }
    document["contacts"]["ground"] = ground;
    if (!vertices.empty()) document["contacts"]["vertices"] = vertices;
  }
  RobotDescription robot = ParseRobot(texts.urdf, document, texts.folder);
  std::cout << DescribeRobot(robot, document, urdf_path, texts.folder);
  const RobotSystem system(std::move(robot), {});
  InitialMode(system, system.nominal().x, system.nominal().u);  // that it can be run
  return 0;
}

}  // namespace
}  // namespace contact_flow

int main(int count, char** words) {
  try {
    return contact_flow::Run(count, words);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
