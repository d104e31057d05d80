// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/trajectory_optimization/piece_models.h"

namespace contact_flow {

/// What the second order of Gauss and Newton leaves out, C ≈ ∇²L − H, learnt from the gradients of
/// successive iterates on pieces with the same order of events (the secant update of Dennis, Gay
/// and Welsch's NL2SOL, sized); and ∇²(L − Σ z (t_second − t_first)) itself, which along the face
/// is the same for all pieces that meet there, by the update of Broyden, Fletcher, Goldfarb and
/// Shanno from H on, as long as the order stays.
class Curvature {
 public:
  /// An iterate with its models, and the multipliers z of the order rows of each.
  void Learn(const Vector& y, const PieceModels& models, const std::vector<Vector>& multipliers);
  /// L changes: the next iterate is not compared with the last one.
  void Forget() { seen_.clear(); }
  /// H + C in place of H, lifted where it is not positive definite; false where there is no C.
  bool Add(PieceModels* models) const;
  /// What was learnt of the whole in place of H; false where there is none.
  bool Replace(PieceModels* models) const;

 private:
  struct Seen {
    std::vector<EventName> order;
    Vector gradient;
    std::vector<OrderRow> rows;
  };
  void Update(const Vector& s, const Vector& change, const Matrix& hessian);

  void UpdateWhole(const Vector& s, const Vector& change);

  Matrix rest_;   // C, or empty
  Matrix whole_;  // ∇²(L − Σ z …), or empty
  Vector y_;
  std::vector<Seen> seen_;
};

}  // namespace contact_flow
