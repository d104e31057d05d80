// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "contact_flow/types.h"

namespace contact_flow {

/// True when the linear-programming library (Clp) is compiled in.
bool HaveLinearPrograms();

/// The answer of one linear program.
struct LinearOptimum {
  double value = 0;  ///< objective·point
  Vector point;      ///< [n]
};

/// A linear program whose bounds are kept while its objective changes:
///   max objective·y   subject to   rows·y ≥ 0,  lower ≤ y ≤ upper (componentwise).
/// rows [h×n], the others [n]. A further objective starts from the last optimum. Without the
/// library no program is ever solved.
class LinearProgram {
 public:
  LinearProgram(const MatrixRef& rows, const VectorRef& lower, const VectorRef& upper);
  ~LinearProgram();
  LinearProgram(LinearProgram&&) noexcept;
  LinearProgram& operator=(LinearProgram&&) noexcept;

  /// Feasible and optimal within 1e-8, which is checked by the duality of linear programs after
  /// each solve; nothing where it is not solved.
  [[nodiscard]] std::optional<LinearOptimum> Maximize(const VectorRef& objective);

 private:
  struct Solver;
  std::unique_ptr<Solver> solver_;
};

}  // namespace contact_flow
