// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "contact_flow/DerivativePiece.h"
#include "contact_flow/RowMajorMatrix.h"
#include "contact_flow/StabilityProof.h"
#include "contact_flow/budget.h"
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "src/session/setup.h"

/// What the answers of analyses have in common: maps, matrices and names in messages.
namespace contact_flow {
namespace ros_interface {

/// Of the outcomes of analyses; its value is the same in all of them.
inline constexpr std::uint8_t kAnalysisCancelled = 5;
/// What ended a search that says that it was cancelled: that, or BUDGET_EXCEEDED.
inline std::uint8_t EndOfSearch() {
  constexpr std::uint8_t kBudgetExceeded = 6;
  return LookAtBudget(nullptr) == BudgetEnd::kSeconds ? kBudgetExceeded : kAnalysisCancelled;
}

std::vector<DerivativePiece> ToMsg(const PiecewiseLinearMap& map);
StabilityProof ToMsg(const StabilityCertificate& certificate);

/// These throw std::invalid_argument, naming field and value, for what is not in order.
Matrix ToMatrix(const std::string& field, const RowMajorMatrix& message);
PiecewiseLinearMap ToMap(const std::string& field, const std::vector<DerivativePiece>& pieces);
/// How a map is checked, as asked; 0: by default. One that is given is believed when it is known to
/// be a map, one of ours unless it is known to be none.
MapConsistencyOptions ResolveConsistency(double tolerance, std::uint32_t max_linear_programs,
                                         bool given, const Setup& setup);
/// Makes the check, once: `options` then say so. Throws std::invalid_argument when pieces that were
/// given are not one continuous map.
MapConsistency CheckMap(const PiecewiseLinearMap& map, bool given, MapConsistencyOptions* options);

StabilityCertificate ToCertificate(const std::string& field, const StabilityProof& proof);
/// Place of a name among those that are valid; `kind` is what it is called.
int NameIndex(const std::string& field, const std::string& kind, const std::string& name,
              const std::vector<std::string>& valid);
/// `asked`, or `standard` for 0; at least 0 and at most `largest`.
double ResolveNumber(const std::string& field, double asked, double standard, double largest);
/// Place among (q, v) [nq+d] of a coordinate, or of a velocity "d/dt NAME".
int StateIndex(const std::string& field, const std::string& name,
               const SystemDescription& description);

/// The settings of analyses that difference returns: the node's, with tolerances no
/// larger than these.
SimulateOptions TightOptions(const Setup& setup);
BDerivativeOptions TightDerivativeOptions(const Setup& setup);

}  // namespace ros_interface
}  // namespace contact_flow
