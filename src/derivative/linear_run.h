// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "arc_tangents.h"
#include "contact_flow/derivative/cost_gradient.h"
#include "run_preparation.h"

namespace contact_flow {

/// A run of which products with the derivative can be made in both directions of time: the start,
/// arcs as ArcTangents, events as pieces, those of a direction where one is given. All that a
/// derivative is held to has been asked.
class LinearRun {
 public:
  /// All must outlive it; `direction` may be null. Throws std::invalid_argument for its sizes.
  LinearRun(const MechanicalSystem& system, const Trajectory& trajectory, const RunCost& cost,
            const BDerivativeOptions& options, const RunDirection* direction,
            const InputCones& cones);

  /// Makes it, and fills what the gradient knows of it; false with its status where there is none.
  /// Throws like EventMap, and NotPiecewiseLinear.
  bool Make(CostGradient* gradient);

  const ArcTangents& arc(std::size_t k) const { return arcs_[k]; }
  /// The piece of transition k; its matrix is empty for the identity.
  const EventPiece& piece(std::size_t k) const { return pieces_[k]; }
  /// Start and events.
  const BDerivative& derivative() const { return derivative_; }
  const Vector& state_error() const { return state_error_; }  ///< of x(T) [2d]
  int size() const { return preparation_.size(); }            ///< 2d+k
  Eigen::Index inputs() const { return inputs_; }          ///< m, or 0 where they are not asked for
  Eigen::Index parameters() const { return parameters_; }  ///< k_p
  Eigen::Index intervals() const { return intervals_; }    ///< K

 private:
  bool ChoosePiece();
  bool Refuse(const std::string& why);
  bool IsKink(const EventMap& event) const;
  bool MakeArcs();
  bool CheckArcs();
  void FindPieces();
  Vector Start() const;
  void SetInput(Eigen::Index interval, Matrix* w) const;
  EventPiece PieceOf(std::size_t k, const VectorRef& w) const;

  const MechanicalSystem& system_;
  const Trajectory& run_;
  const RunCost& cost_;
  const RunDirection* direction_;
  const Eigen::Index d2_, parameters_, inputs_, intervals_;
  RunPreparation preparation_;
  BDerivative derivative_;  // without arcs
  std::vector<ArcTangents> arcs_;
  std::vector<EventPiece> pieces_;
  Vector state_error_;
  CostGradient* gradient_ = nullptr;
};

/// Throws std::invalid_argument unless a part of a direction has `needed` entries, or none.
void RequireDirectionSize(Eigen::Index size, Eigen::Index needed, const char* name);

}  // namespace contact_flow
