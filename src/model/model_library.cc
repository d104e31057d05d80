// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/model_library.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <stdexcept>

#include "contact_flow/model/model_registry.h"
#include "contact_flow/nearest_name.h"
#include "src/model/example/ball_in_corner.h"
#include "src/model/example/block_on_incline.h"
#include "src/model/example/bouncing_ball.h"
#include "src/model/example/ceiling.h"
#include "src/model/example/chair.h"
#include "src/model/example/compass_walker.h"
#include "src/model/example/corner.h"
#include "src/model/example/damped_plate.h"
#include "src/model/example/double_pendulum.h"
#include "src/model/example/driven_ball.h"
#include "src/model/example/falling_box.h"
#include "src/model/example/hopping_trot.h"
#include "src/model/example/jointed_biped.h"
#include "src/model/example/legged_table.h"
#include "src/model/example/puck.h"
#include "src/model/example/rigid_biped.h"
#include "src/model/example/rigid_quadruped.h"
#include "src/model/example/rimless_wheel.h"
#include "src/model/example/rocking_block.h"
#include "src/model/example/simplest_walker.h"
#include "src/model/example/sliding_rod.h"
#include "src/model/example/soft_biped.h"
#include "src/model/example/spinning_ball.h"
#include "src/model/example/steered_trot.h"
#include "src/model/example/two_discs.h"
#include "src/model/example/wall_and_floor.h"

namespace contact_flow {
namespace {

constexpr std::size_t kLongestName = 64;

bool IsName(const std::string& name) {
  if (name.empty() || name.size() > kLongestName) return false;
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return letter(name[0]) && std::all_of(name.begin(), name.end(), [&](char c) {
           return letter(c) || (c >= '0' && c <= '9') || c == '_';
         });
}

/// The models of this process. It only grows.
class Registry {
 public:
  /// The one of the process, with our own models.
  static Registry& Instance() {
    static Registry* registry = new Registry();  // outlives the static objects of libraries
    return *registry;
  }

  void Add(const std::vector<ModelEntry>& entries, const std::string& origin) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::map<std::string, Model> added;
    for (const ModelEntry& entry : entries) {
      const std::string model = Cut(origin, 200) + ": model " + QuoteName(entry.name);
      if (!IsName(entry.name)) {
        throw std::invalid_argument(model + " is no name: expected 1 to " +
                                    std::to_string(kLongestName) +
                                    " letters, digits and underscores, the first one a letter");
      }
      if (!entry.make) throw std::invalid_argument(model + " has no factory");
      const auto taken = models_.find(entry.name);
      if (taken != models_.end()) {
        throw std::invalid_argument(model + " exists already, by " + taken->second.origin);
      }
      if (!added.insert({entry.name, {entry.make, Cut(origin, 200)}}).second) {
        throw std::invalid_argument(model + " is named twice");
      }
    }
    models_.insert(added.begin(), added.end());
  }

  std::vector<std::string> Names() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<std::string> names;
    for (const auto& model : models_) names.push_back(model.first);
    return names;
  }

  /// Empty for an unknown name.
  ModelFactory Find(const std::string& name) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto model = models_.find(name);
    return model == models_.end() ? ModelFactory() : model->second.make;
  }

 private:
  struct Model {
    ModelFactory make;
    std::string origin;
  };

  Registry() {
    Add(
        {
            EntryOf<example::BallInCorner>(),   EntryOf<example::BlockOnIncline>(),
            EntryOf<example::BouncingBall>(),   EntryOf<example::Ceiling>(),
            EntryOf<example::Chair>(),          EntryOf<example::CompassWalker>(),
            EntryOf<example::Corner>(),         EntryOf<example::DampedPlate>(),
            EntryOf<example::DoublePendulum>(), EntryOf<example::DrivenBall>(),
            EntryOf<example::FallingBox>(),     EntryOf<example::HoppingTrot>(),
            EntryOf<example::JointedBiped>(),   EntryOf<example::LeggedTable>(),
            EntryOf<example::Puck>(),           EntryOf<example::RigidBiped>(),
            EntryOf<example::RigidQuadruped>(), EntryOf<example::RimlessWheel>(),
            EntryOf<example::RockingBlock>(),   EntryOf<example::SimplestWalker>(),
            EntryOf<example::SlidingRod>(),     EntryOf<example::SoftBiped>(),
            EntryOf<example::SpinningBall>(),   EntryOf<example::SteeredTrot>(),
            EntryOf<example::TwoDiscs>(),       EntryOf<example::WallAndFloor>(),
        },
        "contact_flow");
  }

  mutable std::mutex mutex_;
  std::map<std::string, Model> models_;
};

}  // namespace

void RegisterModels(const std::vector<ModelEntry>& entries, const std::string& origin) {
  Registry::Instance().Add(entries, origin);
}

std::vector<std::string> ModelNames() { return Registry::Instance().Names(); }

std::unique_ptr<MechanicalSystem> MakeModel(const std::string& name,
                                            const ParameterValues& parameters) {
  const ModelFactory make = Registry::Instance().Find(name);
  if (!make) throw std::invalid_argument(UnknownName("model", name, ModelNames()));
  return make(parameters);
}

}  // namespace contact_flow
