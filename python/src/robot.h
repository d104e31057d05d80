// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace python {

/// A robot with the texts that it is made of.
class Robot : public System {
 public:
  Robot(RobotTexts texts, const ParameterValues& values) : texts_(std::move(texts)) {
    if (texts_.yaml.empty()) texts_.yaml = "{}";  // a URDF alone
    KeepMeshContacts(&texts_);                    // what pickles and bags hold of it
    std::shared_ptr<const RobotSystem> made = MakeRobot(texts_, values);
    robot_ = made.get();
    system = std::move(made);
  }
  std::unique_ptr<MechanicalSystem> Make(const ParameterValues& values) const override {
    return MakeRobot(texts_, values);
  }
  std::shared_ptr<System> With(const ParameterValues& values) const override {
    return std::make_shared<Robot>(texts_, values);
  }
  std::string Origin() const override { return "Robot '" + description().name + "'"; }
  const RobotTexts& texts() const { return texts_; }
  const RobotSystem& robot_system() const { return *robot_; }
  const RobotDescription& robot() const { return robot_->robot(); }

 private:
  RobotTexts texts_;
  const RobotSystem* robot_ = nullptr;  // the system
};

/// Where its links are: a part of BindModels.
void BindRobotPose(py::module_* module);

}  // namespace python
}  // namespace contact_flow
