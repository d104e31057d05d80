// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/io/map_reader.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {

/// The fields of an element from a YAML map.
class YamlFields final : public ElementFields {
 public:
  YamlFields(const RobotModel& model, MapReader* reader, std::vector<std::string>* inputs,
             ElementParts* parts)
      : model_(model), reader_(reader), inputs_(inputs), parts_(parts) {}

  void Point(const std::string& link_key, const std::string& point_key) override;
  void TipOf(const std::string& direction_key, const Vec3<double>& otherwise) override;
  void Tip(const Vec3<double>& direction) override;
  void Joint(const std::string& key) override;
  void Reference(const std::string& key) override;
  void Heights() override;
  void Input(const std::string& key) override;
  void Number(const std::string& key, double otherwise, const char* unit, const char* meaning,
              Range range) override;
  void Vector(const std::string& key, const Vec3<double>& otherwise, const char* unit,
              const char* meaning) override;

 private:
  /// Throws for one of no length.
  void CheckDirection(const std::string& key, const Vec3<double>& direction) const;
  /// The `limit` or `speed` of an effort, where that is the word urdf: its joint's by the URDF.
  bool ReadFromUrdf(const std::string& key, double* value) const;
  void Append(const std::string& key, double value, const char* unit, const char* meaning,
              Range range);

  const RobotModel& model_;
  MapReader* reader_;
  std::vector<std::string>* inputs_;
  ElementParts* parts_;
  Pose last_;                               // of the last point's link in its body
  Vec3<double> at_ = Vec3<double>::Zero();  // the last point that was read, in its body
};

}  // namespace contact_flow
