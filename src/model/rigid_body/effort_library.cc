// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <stdexcept>

#include "contact_flow/model/rigid_body/effort_element.h"
#include "contact_flow/nearest_name.h"
#include "src/model/rigid_body/effort/actuator.h"
#include "src/model/rigid_body/effort/constant_force.h"
#include "src/model/rigid_body/effort/drag.h"
#include "src/model/rigid_body/effort/flywheel.h"
#include "src/model/rigid_body/effort/frame_spring.h"
#include "src/model/rigid_body/effort/joint_spring.h"
#include "src/model/rigid_body/effort/leg_push.h"
#include "src/model/rigid_body/effort/pd.h"
#include "src/model/rigid_body/effort/point_spring.h"
#include "src/model/rigid_body/effort/servo.h"
#include "src/model/rigid_body/effort/timed_force.h"
#include "src/model/rigid_body/effort/track.h"

namespace contact_flow {
namespace {

struct Kind {
  std::unique_ptr<EffortElement> (*make)();
  void (*read)(ElementFields*);
};

template <class K>
std::unique_ptr<EffortElement> Make() {
  return std::make_unique<EffortOf<K>>();
}

template <class K>
std::pair<const std::string, Kind> Entry() {
  return {K::kName, {&Make<K>, &K::Read}};
}

const std::map<std::string, Kind>& Registry() {
  static const std::map<std::string, Kind> registry = {
      Entry<effort::Actuator>(),    Entry<effort::ConstantForce>(),
      Entry<effort::Drag>(),        Entry<effort::Flywheel>(),
      Entry<effort::FrameSpring>(), Entry<effort::JointSpring>(),
      Entry<effort::LegPush>(),     Entry<effort::Pd>(),
      Entry<effort::PointSpring>(), Entry<effort::Servo>(),
      Entry<effort::TimedForce>(),  Entry<effort::Track>(),
  };
  return registry;
}

const Kind& Find(const std::string& kind) {
  const auto it = Registry().find(kind);
  if (it == Registry().end()) {
    throw std::invalid_argument(UnknownName("kind of effort", kind, EffortKinds()));
  }
  return it->second;
}

}  // namespace

std::vector<std::string> EffortKinds() {
  std::vector<std::string> names;
  for (const auto& entry : Registry()) names.push_back(entry.first);
  return names;
}

std::unique_ptr<EffortElement> MakeEffort(const std::string& kind) { return Find(kind).make(); }

void ReadEffort(const std::string& kind, ElementFields* fields) { Find(kind).read(fields); }

}  // namespace contact_flow
