// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/model_library.h"

#include <stdexcept>

#include "contact_flow/model/example/ball_in_corner.h"
#include "contact_flow/model/example/bouncing_ball.h"
#include "contact_flow/model/example/ceiling.h"
#include "contact_flow/model/example/chair.h"
#include "contact_flow/model/example/corner.h"
#include "contact_flow/model/example/damped_plate.h"
#include "contact_flow/model/example/double_pendulum.h"
#include "contact_flow/model/example/falling_box.h"
#include "contact_flow/model/example/hopping_trot.h"
#include "contact_flow/model/example/jointed_biped.h"
#include "contact_flow/model/example/legged_table.h"
#include "contact_flow/model/example/rigid_biped.h"
#include "contact_flow/model/example/rigid_quadruped.h"
#include "contact_flow/model/example/rocking_block.h"
#include "contact_flow/model/example/soft_biped.h"
#include "contact_flow/model/example/wall_and_floor.h"
#include "contact_flow/model/make_system.h"
#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

using Factory = std::unique_ptr<MechanicalSystem> (*)(const ParameterValues&);

template <class Model>
std::pair<const std::string, Factory> Entry() {
  return {Model::kName, &MakeSystem<Model>};
}

const std::map<std::string, Factory>& Registry() {
  static const std::map<std::string, Factory> registry = {
      Entry<example::BallInCorner>(),   Entry<example::BouncingBall>(),
      Entry<example::Ceiling>(),        Entry<example::Chair>(),
      Entry<example::Corner>(),         Entry<example::DampedPlate>(),
      Entry<example::DoublePendulum>(), Entry<example::FallingBox>(),
      Entry<example::HoppingTrot>(),    Entry<example::JointedBiped>(),
      Entry<example::LeggedTable>(),    Entry<example::RigidBiped>(),
      Entry<example::RigidQuadruped>(), Entry<example::RockingBlock>(),
      Entry<example::SoftBiped>(),      Entry<example::WallAndFloor>(),
  };
  return registry;
}

}  // namespace

std::vector<std::string> ModelNames() {
  std::vector<std::string> names;
  for (const auto& entry : Registry()) names.push_back(entry.first);
  return names;
}

std::unique_ptr<MechanicalSystem> MakeModel(const std::string& name,
                                            const ParameterValues& parameters) {
  const auto it = Registry().find(name);
  if (it == Registry().end()) {
    throw std::invalid_argument(UnknownName("model", name, ModelNames()));
  }
  return it->second(parameters);
}

}  // namespace contact_flow
