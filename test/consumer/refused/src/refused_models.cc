// SPDX-License-Identifier: BSD-3-Clause
// Libraries of models as they must not be.
#include <contact_flow/model/model_library.h>
#include <contact_flow/model/model_plugin.h>

#include <pluginlib/class_list_macros.hpp>

namespace refused_models {

std::unique_ptr<contact_flow::MechanicalSystem> Make(const contact_flow::ParameterValues& values) {
  return contact_flow::MakeModel("corner", values);
}

/// Its name is one of contact_flow's.
class Taken : public contact_flow::ModelPlugin {
  std::vector<contact_flow::ModelEntry> Entries() const override { return {{"corner", &Make}}; }
};

contact_flow::ModelAbi OfAnotherProcessor() {
  contact_flow::ModelAbi abi = contact_flow::kModelAbi;
  abi.alignment = 64;
  return abi;
}

class OtherAbi : public contact_flow::ModelPlugin {
 public:
  OtherAbi() : ModelPlugin(OfAnotherProcessor()) {}
  std::vector<contact_flow::ModelEntry> Entries() const override { std::abort(); }
};

}  // namespace refused_models

PLUGINLIB_EXPORT_CLASS(refused_models::Taken, contact_flow::ModelPlugin)
PLUGINLIB_EXPORT_CLASS(refused_models::OtherAbi, contact_flow::ModelPlugin)
