// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "arc_checks.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/variation.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "event_laws.h"
#include "input_cluster.h"

namespace contact_flow {

/// columns ← Φ_k columns [2d+k × ·], by the arcs of a derivative, from its first on.
using ArcProduct = std::function<void(std::size_t k, Matrix* columns)>;

/// What derivatives of a run have in common, whether they have propagators as matrices or as
/// products: the start, the maps of the transitions, and all that is held against them. Refusals
/// are the same in all. System and trajectory must outlive it.
class RunPreparation {
 public:
  /// From the beginning of arc `first` to the end of arc `last`; the cones are of all the run.
  RunPreparation(const MechanicalSystem& system, const Trajectory& trajectory, std::size_t first,
                 std::size_t last, const Variables& variables, InputCones cones);

  /// Fills what a derivative knows of its start; false where its status is not kOk.
  bool Begin(BDerivative* derivative);
  /// Its events, which are held to the laws of events; the same.
  bool MakeEvents(BDerivative* derivative);
  /// Whether arc k may be differentiated; and, `statistics` having been filled, may be believed.
  Status CheckBefore(std::size_t k) const;
  Status CheckAfter(std::size_t k, const VariationStatistics& statistics);
  /// Contacts that touch without force are to touch in every perturbed run.
  Status CheckTouchingContacts(const BDerivative& derivative, const ArcProduct& carry);
  /// CheckRunLaw.
  Status CheckLaw(const ArcProduct& carry, BDerivative* derivative) const;

  /// 2d+k.
  int size() const { return 2 * system_.dof() + dynamics_[first_]->num_variables(); }
  const InputClusters& clusters() const { return clusters_; }
  /// Scratch with the input of arc k.
  ContactDynamics* dynamics(std::size_t k) const { return dynamics_[k].get(); }
  /// … of all arcs, from the first on.
  std::vector<std::shared_ptr<ContactDynamics>> DynamicsOfArcs() const;
  /// F at the end [2d].
  Vector EndField() const;

 private:
  ArcInRun InRun(std::size_t k) const;

  const MechanicalSystem& system_;
  const Trajectory& run_;
  const std::size_t first_, last_;
  const Variables variables_;
  const InputCones cones_;
  const InputClusters clusters_;
  std::vector<std::shared_ptr<ContactDynamics>> dynamics_;
  std::vector<EventResidual> residuals_;
};

}  // namespace contact_flow
