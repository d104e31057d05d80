// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What an arc asks of perturbed runs where rows of the contacts that it holds depend on each
/// other. With A_J the rows that it holds at rest, Zᵀ A_J = 0, and w(t) the tangent,
///   Zᵀ D(A_J v) w(t) = 0:
/// else no velocity holds all of them, one begins to slip or lets go, and Φ w, which meets them by
/// least squares, is not what becomes of w. So a box on two belts, by the speed of one of them, or
/// wheels side by side, one of which is steered. The same of gaps, Zᵀ ∂a_J/∂p δp = 0.
class HeldTogether {
 public:
  /// Of an arc that asks nothing.
  HeldTogether() = default;
  /// Of this one; it is asked at the ends of so many parts. `dynamics` is scratch, its tangents
  /// have the `tolerance` of PropagateArc.
  HeldTogether(ContactDynamics* dynamics, const Arc& arc, double tolerance, int parts = 8);

  bool Empty() const { return instants_.empty(); }
  /// Throws std::domain_error, naming contacts and time, where w at the beginning of the arc
  /// [2d+k] moves apart what is held.
  void Require(const VectorRef& w) const;
  /// kOk where no w does that keeps what can be kept.
  const Status& Whole() const { return whole_; }

 private:
  /// Rows that have to vanish at one instant.
  struct Instant {
    double t = 0;
    Matrix rows;                       // by the tangent there [· × 2d+k]
    Matrix terms;                      // what their entries are sums of, absolute
    std::vector<std::string> sharing;  // the contacts of each row
    Matrix phi;                        // from the beginning of the arc on [2d+k × 2d+k]
  };
  static Instant At(ContactDynamics* dynamics, const Vector& x, ContactMode mode, double t,
                    double least);
  static std::string Sentence(double t, const std::string& contacts);
  void Judge(const Matrix& kept);

  std::vector<Instant> instants_;
  Status whole_;
};

}  // namespace contact_flow
