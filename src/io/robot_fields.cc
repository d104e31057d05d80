// SPDX-License-Identifier: BSD-3-Clause
#include "robot_fields.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace contact_flow {

void YamlFields::Point(const std::string& link_key, const std::string& point_key) {
  std::string name;
  reader_->Require(link_key);
  reader_->Read(link_key, &name);
  Vec3<double> local = Vec3<double>::Zero();
  reader_->Read(point_key, local.data(), 3);
  try {
    const RobotModel::Link& link = model_.FindLink(name);
    parts_->points.push_back({link.body, link.pose * local});
    last_ = link.pose;
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(parts_->name + "/" + link_key + ": " + error.what() +
                                reader_->Line(link_key));
  }
}

void YamlFields::TipOf(const std::string& direction_key, const Vec3<double>& otherwise) {
  Vec3<double> direction = otherwise;
  reader_->Read(direction_key, direction.data(), 3);
  if (!(direction.norm() > 1e-6)) {
    throw std::invalid_argument(parts_->name + "/" + direction_key + " has no direction" +
                                reader_->Line(direction_key));
  }
  AttachedPoint tip = parts_->points.back();
  tip.local += last_.rotation * direction.normalized();
  parts_->points.push_back(tip);
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

void YamlFields::Input(const std::string& key) {
  std::string name;
  reader_->Require(key);
  reader_->Read(key, &name);
  const auto it = std::find(inputs_->begin(), inputs_->end(), name);
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
  reader_->Read(key, &value);
  Append(key, value, unit, meaning, range);
}

void YamlFields::Vector(const std::string& key, const Vec3<double>& otherwise, const char* unit,
                        const char* meaning) {
  if (std::isnan(otherwise(0))) reader_->Require(key);
  Vec3<double> value = otherwise;
  reader_->Read(key, value.data(), 3);
  const char* const suffixes[] = {"_x", "_y", "_z"};
  for (int k = 0; k < 3; ++k) Append(key + suffixes[k], value(k), unit, meaning, Range::kAny);
}

}  // namespace contact_flow
