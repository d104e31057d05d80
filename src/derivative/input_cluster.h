// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// What a change of the input is called in an order.
inline constexpr const char* kInputChange = "input change";

/// Successive transitions of a run, among them changes of the input and events of contacts, each
/// closer to the one before than events that count as simultaneous: one cluster, in which the
/// changes of the input are events.
struct InputCluster {
  std::size_t first = 0, last = 0;  ///< indices of its transitions
  /// At the state of its first event of a contact. Its instants count the change c of the input as
  /// constraint n + c.
  Transition transition;
  Status status;  ///< not kOk: why such a cluster has no map
};

/// Whether `next` comes within the tolerance of simultaneity [s] after `before`.
bool AreClose(const Transition& before, const Transition& next, double simultaneity_tolerance);

/// Whether all rigid contacts of a mode are pressed.
bool HoldsAll(ContactDynamics* dynamics, const Vector& x, ContactMode mode);

/// Whether these are a change of the input and a switch of time alone (DrivenSwitches), what they
/// change of F adds up, and all contacts stay pressed in between: then each is an event of its own,
/// as their order does not matter. With the inputs before and after both.
bool AreIndependent(const MechanicalSystem& system, const std::vector<const Transition*>& parts,
                    const Vector& before, const Vector& after);

/// The cluster that these transitions are. Not kOk where a slip in space begins or ends, with an
/// effort that depends on the contact mode, where contacts touch without force, where one is met
/// twice, and where one is met only because of the impact of another.
InputCluster UniteWithInput(const MechanicalSystem& system,
                            const std::vector<const Transition*>& transitions);

/// All of a run, in the order of time.
std::vector<InputCluster> FindInputClusters(const MechanicalSystem& system,
                                            const Trajectory& trajectory);

/// Those of one run, by its transitions and arcs. System and trajectory must outlive it.
class InputClusters {
 public:
  InputClusters(const MechanicalSystem& system, const Trajectory& trajectory)
      : system_(system), run_(trajectory), all_(FindInputClusters(system, trajectory)) {}

  /// That of transition k, or null.
  const InputCluster* At(std::size_t k) const;
  /// That of which arc k lies inside, or null. Such an arc has no length to first order.
  const InputCluster* Around(std::size_t k) const;
  /// The first-order map of one.
  EventMap Map(const InputCluster& cluster, const Variables& variables) const;
  /// F at the end of arc k, `dynamics` having its input; behind the cluster if it is inside one.
  Vector EndField(ContactDynamics* dynamics, std::size_t k) const;

 private:
  const MechanicalSystem& system_;
  const Trajectory& run_;
  const std::vector<InputCluster> all_;
};

}  // namespace contact_flow
