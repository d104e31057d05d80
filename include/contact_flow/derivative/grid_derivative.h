// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/linearization.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// The B-derivative of the outcome x(T) of a run under inputs on a grid, along changes of the
/// initial state, of the input of each of its K intervals, and of the instants when they change:
///   δx_{k+1} = B_k(δx_k, δu_k) + (F⁻ − F⁺) δt_{k+1},
/// where B_k(δx_k, δu_k, δt_{k+1}) takes the place of the sum if events of contacts coincide with
/// the instant.
class GridDerivative {
 public:
  /// Of a trajectory made with SimulateOptions::dense; `system` must outlive this.
  GridDerivative(const MechanicalSystem& system, const Trajectory& trajectory,
                 const BDerivativeOptions& options = {});

  /// Not kOk: that of the first interval that has no derivative.
  const Status& status() const { return status_; }
  /// Those of the grid, K of them.
  const std::vector<IntervalLinearization>& intervals() const { return intervals_; }

  /// δx(T) [2d] for δx_0 [2d], δu [m × K] and δt [K−1] or none. Throws std::invalid_argument for
  /// sizes, directions that leave the domain and instants that would change places, and
  /// std::domain_error like BDerivative.
  Vector operator()(const VectorRef& dx, const MatrixRef& du, const VectorRef& dt = Vector()) const;
  /// Contact modes that the perturbed run passes through, to first order.
  std::vector<ContactMode> PerturbedModes(const VectorRef& dx, const MatrixRef& du) const;

 private:
  Vector Follow(const VectorRef& dx, const MatrixRef& du, const VectorRef& dt,
                std::vector<ContactMode>* modes) const;

  Status status_;
  std::vector<IntervalLinearization> intervals_;
  /// F⁻ − F⁺ at each instant [2d]; empty where it belongs to a cluster.
  std::vector<Vector> jumps_;
};

}  // namespace contact_flow
