// SPDX-License-Identifier: BSD-3-Clause
#include "robot_fields.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/nearest_name.h"

namespace contact_flow {

void YamlFields::Point(const std::string& link_key, const std::string& point_key) {
  std::string name;
  reader_->Require(link_key);
  reader_->Read(link_key, &name);
  Vec3<double> local = Vec3<double>::Zero();
  reader_->Read(point_key, local.data(), 3);
  const auto& links = model_.links;
  if (name == "world" && std::none_of(links.begin(), links.end(),
                                      [](const auto& link) { return link.name == "world"; })) {
    parts_->points.push_back({-1, local});
    last_ = Pose();
    at_ = local;
    return;
  }
  try {
    const RobotModel::Link& link = model_.FindLink(name);
    const int index = static_cast<int>(&link - model_.links.data());
    parts_->points.push_back({link.body, link.pose * local, index});
    last_ = link.pose;
    at_ = parts_->points.back().local;
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(parts_->name + "/" + link_key + ": " + error.what() +
                                reader_->Line(link_key));
  }
}

void YamlFields::TipOf(const std::string& direction_key, const Vec3<double>& otherwise) {
  Vec3<double> direction = otherwise;
  reader_->Read(direction_key, direction.data(), 3);
  CheckDirection(direction_key, direction);
  Tip(direction.normalized());
}

void YamlFields::CheckDirection(const std::string& key, const Vec3<double>& direction) const {
  if (direction.norm() > 1e-6) return;
  throw std::invalid_argument(parts_->name + "/" + key +
                              " has no direction: give one, as [0, 0, 1]" + reader_->Line(key));
}

void YamlFields::Tip(const Vec3<double>& direction) {
  // From the point that was read, not from a tip of it.
  parts_->points.push_back({parts_->points.back().body, at_ + last_.rotation * direction, -1});
}

void YamlFields::Reference(const std::string& key) {
  reader_->Require(key);
  const std::string name = parts_->name + "/" + key;
  MapReader reader(reader_->Child(key), name);
  int kind = 1;
  bool periodic = false;
  double blend = 0;
  std::vector<double> times, values;
  for (const char* required : {"times", "values"}) reader.Require(required);
  reader.Read("times", &times);
  reader.Read("values", &values);
  reader.Read("kind", TimeFunction::KindNames(), &kind);
  reader.Read("periodic", &periodic);
  const bool blended = static_cast<TimeFunction::Kind>(kind) == TimeFunction::Kind::kBlended;
  if (blended) reader.Require("blend");
  reader.Read("blend", &blend);
  reader.Finish();
  if (!blended && reader.Has("blend")) {
    throw std::invalid_argument(name + "/blend is of kind: blended alone" + reader.Line("blend"));
  }
  try {
    parts_->reference = std::make_shared<const TimeFunction>(static_cast<TimeFunction::Kind>(kind),
                                                             times, values, periodic, blend);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(name + ": " + error.what() + reader_->Line(key));
  }
  parts_->joints.push_back(model_.ClockCoordinate());
}

void YamlFields::Joint(const std::string& key) {
  std::string name;
  reader_->Require(key);
  reader_->Read(key, &name);
  try {
    parts_->joints.push_back(model_.FindCoordinate(name));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(parts_->name + "/" + key + ": " + error.what() +
                                reader_->Line(key));
  }
}

void YamlFields::Heights() {
  double origin[2] = {0, 0}, step[2] = {1, 1};
  reader_->Require("heights");
  reader_->Require("step");
  reader_->Read("origin", origin, 2);
  reader_->Read("step", step, 2);
  const YAML::Node rows = reader_->Child("heights");
  const std::string name = parts_->name + "/heights";
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(name + " " + why + reader_->Line("heights"));
  };
  if (!rows.IsSequence() || rows.size() == 0) refuse("is no list of rows of numbers");
  Matrix heights;
  for (std::size_t j = 0; j < rows.size(); ++j) {  // rows along y, their numbers along x
    const std::string key = "row " + std::to_string(j + 1);
    YAML::Node map;
    map[key] = rows[j];
    std::vector<double> row;
    MapReader(map, name).Read(key, &row);
    const auto length = static_cast<Eigen::Index>(row.size());
    if (j == 0) heights.resize(length, static_cast<Eigen::Index>(rows.size()));
    if (length != heights.rows()) refuse("has rows of different lengths");
    heights.col(static_cast<Eigen::Index>(j)) =
        Eigen::Map<const Eigen::VectorXd>(row.data(), length);
  }
  try {
    const HeightGrid::Frame frame = {origin[0], origin[1], step[0], step[1]};
    parts_->heights = std::make_shared<const HeightGrid>(frame, heights);
  } catch (const std::invalid_argument& error) {
    refuse("are no terrain: " + std::string(error.what()));
  }
}

void YamlFields::Input(const std::string& key) {
  std::string name;
  reader_->Require(key);
  reader_->Read(key, &name);
  const auto it = std::find(inputs_->begin(), inputs_->end(), name);
  double number = 0;
  const bool is_value = name.empty() || YAML::convert<double>::decode(YAML::Node(name), number);
  if (it == inputs_->end() && is_value) {
    throw std::invalid_argument(parts_->name + "/" + key + " is " + QuoteName(name) +
                                ", expected the name of an input: its value is of "
                                "nominal/inputs, or of a schedule" +
                                reader_->Line(key));
  }
  parts_->inputs.push_back(static_cast<int>(it - inputs_->begin()));
  if (it == inputs_->end()) inputs_->push_back(name);
}

void YamlFields::Append(const std::string& key, double value, const char* unit, const char* meaning,
                        Range range) {
  try {
    CheckParameter(parts_->name, key, value, range);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(error.what() + reader_->Line(key));
  }
  parts_->numbers.push_back({key, unit, meaning, value});
  parts_->ranges.push_back(range);
}

void YamlFields::Number(const std::string& key, double otherwise, const char* unit,
                        const char* meaning, Range range) {
  if (std::isnan(otherwise)) reader_->Require(key);
  double value = otherwise;
  if (!ReadFromUrdf(key, &value)) reader_->Read(key, &value);
  Append(key, value, unit, meaning, range);
}

bool YamlFields::ReadFromUrdf(const std::string& key, double* value) const {
  if ((key != "limit" && key != "speed") || parts_->joints.empty() || !reader_->Has(key)) {
    return false;
  }
  const YAML::Node node = reader_->Child(key);
  if (!node.IsScalar() || node.Scalar() != "urdf") return false;
  const std::string& joint = model_.coordinates[parts_->joints.front().q];
  for (const RobotModel::JointTraits& traits : model_.traits) {
    if (traits.name == joint) *value = key == "limit" ? traits.effort : traits.speed;
  }
  if (*value > 0 && *value < kUnlimited) return true;
  throw std::invalid_argument(parts_->name + "/" + key + ": the URDF gives joint '" + joint +
                              "' no largest " + (key == "limit" ? "effort" : "velocity") +
                              reader_->Line(key));
}

void YamlFields::Vector(const std::string& key, const Vec3<double>& otherwise, const char* unit,
                        const char* meaning) {
  if (std::isnan(otherwise(0))) reader_->Require(key);
  Vec3<double> value = otherwise;
  reader_->Read(key, value.data(), 3);
  if (*unit == '\0') CheckDirection(key, value);
  const char* const suffixes[] = {"_x", "_y", "_z"};
  for (int k = 0; k < 3; ++k) Append(key + suffixes[k], value(k), unit, meaning, Range::kAny);
}

}  // namespace contact_flow
