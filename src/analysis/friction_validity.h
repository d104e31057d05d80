// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "effort_watches.h"
#include "watched_guards.h"

namespace contact_flow {

/// ValidityEstimator of a system with friction. A perturbed run has another sequence of words where
///   a guard of an arc reaches zero that does not there, where it is least or at its ends,
///   one that grows from zero behind an event no longer does,
///   one that vanishes no longer crosses zero, dh/dt = 0,
///   events of different clusters change places, or pass the start or the horizon,
///   an impulse of a single touchdown leaves or enters its cone, or vanishes.
class FrictionValidity {
 public:
  FrictionValidity(const MechanicalSystem& system, const Trajectory& trajectory,
                   const BDerivative& derivative);

  ValidityRadius operator()(const VectorRef& w) const;

 private:
  using Limit = ValidityRadius::Limit;

  /// A guard at a place of an arc, and how it moves with a tangent at the begin of the arc, or at
  /// its end for those that are watched there, and with the instant.
  struct Watch {
    Limit limit;
    int constraint;
    double t, value, rate;
    Eigen::RowVectorXd gradient;
  };
  /// What is watched of one arc.
  struct Watched {
    bool absorbed = false;  // by the cluster before it: without length
    ContactMode mode;
    std::unique_ptr<ContactDynamics> dynamics;
    std::unique_ptr<WatchedGuards> guards;
    WatchedGuards::Values begin, end;
    std::vector<Watch> begins, dips, ends;
    std::vector<Eigen::Index> growing;    // from zero
    std::vector<Eigen::Index> vanishing;  // at the end
  };
  /// The first and the last event of a cluster of the run perturbed along w.
  struct Instants {
    double first = 0, last = 0;
  };

  /// Up to which a guard counts as zero: where an event of guards was located, to what that leaves
  /// of them, else to rounding.
  double ZeroOf(const WatchedGuards::Guard& guard, const WatchedGuards::Values& at,
                bool located) const;
  bool BeginsAtZero(std::size_t k, Eigen::Index guard) const;
  bool EndsAtZero(std::size_t k, Eigen::Index guard) const;
  bool BeginsLocated(std::size_t k) const;
  bool BeganAtCone(std::size_t k, int slip) const;
  void WatchEnds(std::size_t k);
  void WatchDips(std::size_t k);
  Instants InstantsOf(std::size_t k, const Vector& w) const;
  double SpeedChange(const ContactDynamics& dynamics, int constraint, const Vector& x,
                     const Vector& w) const;
  double RateChange(const Watched& of, Eigen::Index guard, const Vector& x, double rate,
                    const Vector& along) const;
  void CheckCrossings(std::size_t k, const Vector& w, ValidityRadius* smallest) const;
  void CheckGrowing(std::size_t k, const Vector& w, double shift, ValidityRadius* smallest) const;
  bool SharesImpulses(const Transition& transition) const;
  void CheckImpulses(std::size_t k, const Vector& w, double time, ValidityRadius* smallest) const;

  const MechanicalSystem& system_;
  const Trajectory& trajectory_;
  const BDerivative& derivative_;
  std::vector<Watched> arcs_;
  EffortWatches efforts_;
};

}  // namespace contact_flow
