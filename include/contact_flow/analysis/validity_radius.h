// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

class EffortWatches;
class FrictionValidity;

/// How far along a direction a B-derivative holds.
struct ValidityRadius {
  /// What changes there.
  enum class Limit {
    kNone,           ///< nothing that first order shows
    kEventOrder,     ///< two events that are not simultaneous change places
    kStart,          ///< an event leaves the run at its start
    kHorizon,        ///< an event leaves the run at its end, or comes in
    kApproachSpeed,  ///< a touchdown becomes a grazing one
    kReleaseRate,    ///< a release no longer happens, its force only touches zero
    kGap,            ///< a contact that stays open is made
    kForce,          ///< a contact that holds lets go
    kImpulse,        ///< a contact that rests is lifted by the impact of another, or no longer is
    kCone,           ///< the force of a contact that sticks reaches its cone
    kSlip,           ///< a slip ends
    kSlipRate,       ///< a slip no longer begins or ends, it only nearly does
    kImpulseCone,    ///< a contact slips in an impact, or no longer does
    kEffort,         ///< an effort reaches its limit, or no longer does
  };
  double radius = std::numeric_limits<double>::infinity();  ///< α > 0, a factor on w
  Limit limit = Limit::kNone;                               ///< what changes there
  int constraint = -1;      ///< whose event it is, −1: a whole transition
  double t = 0;             ///< of the unperturbed run [s]
  std::string effort = "";  ///< whose limit it is (EffortLimits), or ""
};

/// "event order", …
const char* LimitName(ValidityRadius::Limit limit);
/// "the gap of 'ceiling' closes at t = 0.4 s", for people.
std::string Describe(const SystemDescription& description, const ValidityRadius& radius);

/// Estimates from the margins of a run, each divided by its first-order change along w, the
/// smallest α > 0 at which the run from x + α w has another sequence of events than those that the
/// B-derivative unites: beyond it the derivative is that of another run. Every gap, and every
/// force that holds a contact, is looked at where it is least and at both ends of every arc:
/// behind an impact or a change of the input forces begin anew. At the impact of one contact it is
/// the impulses of those that rest, too, and the speeds of those that it lifts. Events of one
/// cluster are united in any order and set no limit, but a contact that one of them sets into
/// flight has to be there still at the next. Not looked at are curvature, the error O(α²) inside,
/// forces and impulses between the events of one cluster, changes of release rates by (δu, δp), and
/// whether a second motion fits beside the one that was taken (Painlevé). With friction the letters
/// belong to the sequence: forces in their cones, slips, and the impulses of a single touchdown are
/// looked at, too, but the latter not by δp, nor where contacts share them, and not the rate at
/// which a slip in space ends. Efforts are looked at beside their limits where they turn, and at
/// both ends of every arc.
class ValidityEstimator {
 public:
  /// For a derivative that exists. `system`, `trajectory` and `derivative` must outlive this. Costs
  /// the propagators to the dips of gaps and forces, as much as the derivative itself for each.
  ValidityEstimator(const MechanicalSystem& system, const Trajectory& trajectory,
                    const BDerivative& derivative);
  ~ValidityEstimator();

  /// For w = (δq, δv, δu, δp) [2d+k] or (δq, δv) [2d]. O(N m² d) beside B(w). The radius is NaN,
  /// not known, where a slip begins in space.
  ValidityRadius operator()(const VectorRef& w) const;

 private:
  /// A gap or force that comes near zero, and how it moves with a tangent: for a dip that at the
  /// begin of its arc, for an end of an arc that there, and with the instant of that end.
  struct Watch {
    ValidityRadius::Limit limit = ValidityRadius::Limit::kGap;
    int constraint = 0;
    double t = 0;
    double value = 0;
    Eigen::RowVectorXd gradient;  // [1 × 2d+k]
    double rate = 0;              // [m/s] or [N/s]
  };
  Eigen::RowVectorXd GuardGradient(std::size_t arc, const VectorRef& x, int guard) const;
  void WatchStart();
  void WatchBegin(std::size_t arc);
  void WatchDips(std::size_t arc);
  void WatchEnd(std::size_t arc);
  void ConsiderWatch(const Watch& watch, const Vector& w, double shift,
                     ValidityRadius* smallest) const;
  void CheckEvent(std::size_t k, const Vector& w, ValidityRadius* smallest) const;
  void CheckImpact(std::size_t k, const Vector& w, const Vector& after, double time,
                   ValidityRadius* smallest) const;

  const MechanicalSystem& system_;
  const Trajectory& trajectory_;
  const BDerivative& derivative_;
  std::vector<std::unique_ptr<ContactDynamics>> dynamics_;  // of each arc
  std::vector<Watch> starts_;                               // by tangents at the start
  std::vector<std::vector<Watch>> begins_;                  // by tangents at the begin of each arc
  std::vector<std::vector<Watch>> dips_;                    // by tangents at the begin of each arc
  std::vector<std::vector<Watch>> ends_;                    // by tangents at the end of each arc
  std::unique_ptr<FrictionValidity> with_friction_;         // instead of these
  std::unique_ptr<EffortWatches> efforts_;
};

}  // namespace contact_flow
