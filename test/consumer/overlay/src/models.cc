// SPDX-License-Identifier: BSD-3-Clause
#include <contact_flow/model/model_plugin.h>
#include <contact_flow/model/model_system.h>

#include <pluginlib/class_list_macros.hpp>

#include "dropped_ball.h"

namespace my_models {

class Models : public contact_flow::ModelPlugin {
 public:
  std::vector<contact_flow::ModelEntry> Entries() const override {
    return {contact_flow::EntryOf<DroppedBall>()};
  }
};

}  // namespace my_models

PLUGINLIB_EXPORT_CLASS(my_models::Models, contact_flow::ModelPlugin)
