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

struct EffortKind {
  std::unique_ptr<EffortElement> (*make)();
  void (*read)(ElementFields*);
};

template <class K>
std::unique_ptr<EffortElement> MakeEffortOf() {
  return std::make_unique<EffortOf<K>>();
}

template <class K>
std::pair<const std::string, EffortKind> EffortEntry() {
  return {K::kName, {&MakeEffortOf<K>, &K::Read}};
}

const std::map<std::string, EffortKind>& Efforts() {
  static const std::map<std::string, EffortKind> registry = {
      EffortEntry<effort::Actuator>(),    EffortEntry<effort::ConstantForce>(),
      EffortEntry<effort::Drag>(),        EffortEntry<effort::Flywheel>(),
      EffortEntry<effort::FrameSpring>(), EffortEntry<effort::JointSpring>(),
      EffortEntry<effort::LegPush>(),     EffortEntry<effort::Pd>(),
      EffortEntry<effort::PointSpring>(), EffortEntry<effort::Servo>(),
      EffortEntry<effort::TimedForce>(),  EffortEntry<effort::Track>(),
  };
  return registry;
}

const EffortKind& FindEffort(const std::string& kind) {
  const auto it = Efforts().find(kind);
  if (it == Efforts().end()) {
    throw std::invalid_argument(UnknownName("kind of effort", kind, EffortKinds()));
  }
  return it->second;
}

}  // namespace

std::vector<std::string> EffortKinds() {
  std::vector<std::string> names;
  for (const auto& entry : Efforts()) names.push_back(entry.first);
  return names;
}

std::unique_ptr<EffortElement> MakeEffort(const std::string& kind) {
  return FindEffort(kind).make();
}

void ReadEffort(const std::string& kind, ElementFields* fields) { FindEffort(kind).read(fields); }

}  // namespace contact_flow
